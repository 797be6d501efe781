"""Timetable: the order in which robots pass where their paths come close, and the times that follow.

The order is decided conflict by conflict, at first by who would be there first. Each decision becomes gates; a set of
gates that a run through the paths gets to the end of has no circle, so nobody ever waits for somebody who waits for
him, however late any of them is: gates speak of places, not of times (action dependency graphs: Hönig et al.,
"Persistent and Robust Execution of MAPF Schedules in Warehouses", IEEE RA-L 2019; precedence that is kept under delays:
Čáp et al., "Provably Safe and Deadlock-Free Execution of Multi-Robot Plans under Delaying Disturbances", IROS 2016).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.traffic.conflicts import Conflict, TimedPath, conflicts
from touchline.coordination.traffic.gates import Gate, gates
from touchline.core.plain_sum import plain_sum

ROUNDS: Final = 3
"""Rounds in which every decision is tried the other way round."""
_STUCK_S: Final = 1e6

Floats = NDArray[np.float64]


class Delay(NamedTuple):
    """Delay of a robot's plan from an arc length on."""

    from_m: float
    seconds: float


@dataclass(frozen=True)
class Timetable:
    """Gates of all robots, and their consequences if all goes as planned.

    Attributes:
        gates: All of them.
        delays: Delays of each robot, ascending.
        ends_s: Time at which each robot is done.
    """

    gates: tuple[Gate, ...]
    delays: tuple[tuple[Delay, ...], ...]
    ends_s: tuple[float, ...]

    @property
    def waits_s(self) -> tuple[float, ...]:
        """Total waiting time of each robot."""
        return tuple(each[-1].seconds if each else 0.0 for each in self.delays)

    @property
    def end_s(self) -> float:
        """Time at which all are done."""
        return max(self.ends_s)


def timetable(paths: Sequence[TimedPath], apart_m: float) -> Timetable | None:
    """Return the best timetable found; None if there is none without a robot that blocks another for good.

    Args:
        paths: Paths of the robots, in their order.
        apart_m: Clearance between bodies, m.
    """
    found = conflicts(paths, apart_m)
    if not all(each.possible for each in found):
        return None
    offers = [
        {first: gates(each, first, paths[each.other(first)], paths[first].back_m) for first in each.robots}
        for each in found
    ]
    orders = []
    for each, offer in zip(found, offers, strict=True):
        free = [robot for robot in each.robots if offer[robot] is not None and each.forced in (robot, -1)]
        if not free:
            return None
        orders.append(sorted(free, key=lambda robot: _there_s(each, robot, paths[robot])))
    chosen = [order[0] for order in orders]
    best = _run(paths, offers, chosen)
    for _ in range(ROUNDS):
        before = best.cost_s
        for k, order in enumerate(orders):
            if len(order) < len(found[k].robots):
                continue
            other = [*chosen[:k], found[k].other(chosen[k]), *chosen[k + 1 :]]
            run = _run(paths, offers, other)
            if run.cost_s < best.cost_s - 1e-9:
                chosen, best = other, run
        if best.cost_s >= before:
            break
    return best.table if best.cost_s < _STUCK_S else None


def _there_s(conflict: Conflict, robot: int, path: TimedPath) -> float:
    """Return when a robot would be in the middle of a conflict."""
    own_m = conflict.seen_by(robot)[:, 0]
    return float(np.interp(0.5 * (own_m.min() + own_m.max()), path.arc_m, path.time_s))


class _Run(NamedTuple):
    """Outcome and cost of some decisions; more than `_STUCK_S` if a robot gets stuck."""

    table: Timetable
    cost_s: float


def _run(paths: Sequence[TimedPath], offers: Sequence[dict[int, list[Gate] | None]], chosen: Sequence[int]) -> _Run:
    """Simulate all robots as planned, each waiting at its gates."""
    all_gates = [gate for offer, first in zip(offers, chosen, strict=True) for gate in offer[first] or ()]
    todo = [sorted((g for g in all_gates if g.robot == i), key=lambda g: g.at_m) for i in range(len(paths))]
    passed, delays = [0] * len(paths), [list[Delay]() for _ in paths]

    def when(robot: int, arc_m: float) -> float:
        late = next((each.seconds for each in reversed(delays[robot]) if each.from_m < arc_m), 0.0)
        return float(np.interp(arc_m, paths[robot].arc_m, paths[robot].time_s)) + late

    def next_gate(robot: int) -> Gate | None:
        return todo[robot][passed[robot]] if passed[robot] < len(todo[robot]) else None

    def let_pass(robot: int) -> bool:
        """Pass the robot's next gate if it is known to open, and return whether it was passed."""
        gate = next_gate(robot)
        if gate is None:
            return False
        ahead = next_gate(gate.other)
        if ahead is not None and gate.clear_m > ahead.at_m:
            return False
        opens, late = when(gate.other, gate.clear_m), delays[robot][-1].seconds if delays[robot] else 0.0
        comes = float(np.interp(gate.at_m, paths[robot].arc_m, paths[robot].time_s)) + late
        if opens > comes:
            stop_s = paths[robot].stop_s if not (delays[robot] and delays[robot][-1].from_m == gate.at_m) else 0.0
            delays[robot].append(Delay(gate.at_m, late + opens - comes + stop_s))
        passed[robot] += 1
        return True

    moved = True
    while moved:
        moved = sum(let_pass(robot) for robot in range(len(paths))) > 0
    ends = tuple(when(robot, np.inf) for robot in range(len(paths)))
    stuck = sum(len(gates_) - done for gates_, done in zip(todo, passed, strict=True))
    table = Timetable(tuple(sorted(all_gates)), tuple(map(tuple, delays)), ends)
    return _Run(table, max(ends) + 0.01 * plain_sum(ends) + _STUCK_S * stuck)
