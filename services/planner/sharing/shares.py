"""Shares of a template for several robots: swaths of about the same total time, spatially apart.

Initial shares are cuts across the field in several directions and a divided tour. They are improved by moving single
swaths or exchanging two, as long as that shortens the time of the slowest robot. Neighbouring swaths of different
robots cost some seconds, as one has to wait for the other there.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Template
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.sharing.workload import Workload

NEAR_S = 2.0
"""Price of a pair of near swaths of different robots."""
LONGEST = 8
"""Exponent of the norm that approximates the time of the slowest robot, so that several slow ones all count."""
ALL_SHARE = 0.05
"""Share of the total time of all robots in the cost."""
CUTS_RAD = tuple(math.radians(angle) for angle in (0, 90, 30, 60, 120, 150, 180, 270))
"""Directions along which the field is cut."""
LOOKED_AT, LOOKED_AT_LEAST, FEW = 600, 40, 40
"""Number of shares that are timed from one beginning: for a few swaths, and the minimum for many, which take longer."""


@dataclass(frozen=True)
class Sharing:
    """Division of a template among robots.

    Attributes:
        shares: For each robot, the template with its swaths only.
        seconds: Approximate time of each robot.
        cost_s: Cost by which divisions are compared.
    """

    shares: tuple[Template, ...]
    seconds: tuple[float, ...]
    cost_s: float


def sharings(task: PlanTask, robots: int) -> list[Sharing]:
    """Find divisions of a template among robots, the best by rough figures first.

    Args:
        task: Template, vehicle and options, the same for all robots.
        robots: Number of robots, at least 2.

    Raises:
        PlanningError: The template has areas or fewer swaths than robots, or an option or a segment cannot be met.
    """
    if task.template.areas:
        problem = f'has the area "{task.template.areas[0].id}", and robots that paint share lines alone'
        raise PlanningError("", problem, "give each robot a template of its own, or leave out --robots")
    work = Workload.of(task)
    if len(work.ids) < robots:
        problem = f"has {len(work.ids)} swaths, too few for {robots} robots"
        raise PlanningError("", problem, f"give at most {len(work.ids)} robots")
    found = {}
    for begun in _beginnings(work, robots):
        owner = _numbered(_improved(work, begun))
        found[owner] = _cost_s(work, owner)
    return [_sharing(task.template, work, owner) for owner in sorted(found, key=lambda each: found[each])]


def _numbered(owner: tuple[int, ...]) -> tuple[int, ...]:
    """Renumber the robots, which are alike, in the order of their first swaths."""
    numbers = {robot: number for number, robot in enumerate(dict.fromkeys(owner))}
    return tuple(numbers[robot] for robot in owner)


def _sharing(template: Template, work: Workload, owner: tuple[int, ...]) -> Sharing:
    shares = _shares(owner)
    taken = [{name for swath in share for name in work.ids[swath]} for share in shares]
    parts = (tuple(segment for segment in template.segments if segment.id in names) for names in taken)
    return Sharing(
        tuple(template.model_copy(update={"segments": part}) for part in parts),
        tuple(work.seconds(share) for share in shares),
        _cost_s(work, owner),
    )


def _shares(owner: Sequence[int]) -> list[list[int]]:
    """Swaths of each robot."""
    return [[swath for swath, robot in enumerate(owner) if robot == each] for each in range(max(owner) + 1)]


def _cost_s(work: Workload, owner: Sequence[int]) -> float:
    seconds = [work.seconds(share) for share in _shares(owner)]
    robot = np.array(owner)
    apart = robot[:, None] != robot[None, :]
    longest = float(np.linalg.norm(seconds, ord=LONGEST))
    return longest + ALL_SHARE * plain_sum(seconds) + NEAR_S * 0.5 * float(np.count_nonzero(work.near & apart))


def _beginnings(work: Workload, robots: int) -> Iterator[tuple[int, ...]]:
    """Initial shares, as the number of the robot of each swath: cuts across the field, and of a tour."""
    for angle in CUTS_RAD:
        along = work.middles @ (math.cos(angle), math.sin(angle))
        across = work.middles @ (-math.sin(angle), math.cos(angle))
        yield _cut(work, np.lexsort((across.round(3), along.round(3))).tolist(), robots)
    yield _cut(work, work.tour(), robots)


def _cut(work: Workload, order: Sequence[int], robots: int) -> tuple[int, ...]:
    """Divide the swaths in this order into runs of about the same time, none of them empty."""
    reached = np.cumsum([work.seconds((swath,)) for swath in order])
    owner = np.zeros(len(order), dtype=np.int64)
    bounds = [int(np.searchsorted(reached, reached[-1] * k / robots)) for k in range(1, robots)]
    bounds = [min(max(bound, k + 1), len(order) - robots + k + 1) for k, bound in enumerate(bounds)]
    for robot, (first, last) in enumerate(pairwise((0, *bounds, len(order)))):
        owner[[order[k] for k in range(first, last)]] = robot
    return tuple(owner.tolist())


def _improved(work: Workload, begun: tuple[int, ...]) -> tuple[int, ...]:
    """Move to the best neighbour until none is better."""
    owner, least, looked_at = begun, _cost_s(work, begun), 0
    most = max(LOOKED_AT * min(FEW / len(begun), 1.0) ** 2, LOOKED_AT_LEAST)
    while looked_at < most:
        best = owner
        for other in islice(_neighbours(work, owner), max(int(most) - looked_at, 0)):
            looked_at += 1
            if (cost := _cost_s(work, other)) < least - 1e-6:
                best, least = other, cost
        if best is owner:
            break
        owner = best
    return owner


def _neighbours(work: Workload, owner: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Shares in which the slowest robot hands over a swath, or exchanges it for one near it."""
    shares = _shares(owner)
    slowest = max(range(len(shares)), key=lambda robot: work.seconds(shares[robot]))
    for swath in shares[slowest]:
        for robot in range(len(shares)):
            if robot != slowest and len(shares[slowest]) > 1:
                yield _changed(owner, {swath: robot})
        off = np.hypot(*(work.middles - work.middles[swath]).T)
        others = [k for k in np.argsort(off, kind="stable").tolist() if owner[k] != slowest]
        for other in others[:EXCHANGED]:
            yield _changed(owner, {swath: owner[other], other: slowest})


EXCHANGED = 8
"""Number of nearest swaths of other robots that are tried in exchange."""


def _changed(owner: tuple[int, ...], changes: dict[int, int]) -> tuple[int, ...]:
    return tuple(changes.get(swath, robot) for swath, robot in enumerate(owner))
