"""Rough duration of subsets of a template's swaths for one robot, and neighbouring swaths."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.sequencing.costs import problem
from touchline.services.planner.sequencing.order import Problem, ordered
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, Swath, swaths
from touchline.services.planner.tour import ordering

KICKS = 200
"""Kicks of the search for a rough tour: enough to tell which of two shares takes longer."""
NEAR_M = 2.5
"""Distance below which robots on two swaths obstruct each other."""
_SAMPLE_M = 0.5


@dataclass(frozen=True)
class Workload:
    """Swaths of a template, with their costs and positions.

    Attributes:
        ids: Segment ids of each swath.
        asked: Ordering problem of all swaths.
        middles: (swaths, 2) middles of the swaths, m.
        near: (swaths, swaths) whether two are nearer to each other than `NEAR_M`.
    """

    ids: tuple[tuple[str, ...], ...]
    asked: Problem
    middles: Floats
    near: NDArray[np.bool_]
    _known: dict[frozenset[int], float] = field(default_factory=dict)

    @classmethod
    def of(cls, task: PlanTask) -> "Workload":
        """Time the swaths of a template of lines with the planner's transitions.

        Raises:
            PlanningError: An option or a segment cannot be met.
        """
        free = ordering(task.options)
        painting = Painting.of(task.vehicle, task.limits, task.options)
        choices = modes(task.template.segments, task.vehicle, task.limits.curvature_max_1pm, free=free)
        groups = swaths(choices, painting, free=free)
        asked, _ = problem(groups, transitions_of(task.vehicle, task.options, task.limits), painting, None)
        ids = tuple(tuple(stroke.id for stroke in group[0].strokes) for group in groups)
        points = [_points(group[0]) for group in groups]
        return cls(ids, asked, np.array([each.mean(axis=0) for each in points]), _near(points))

    def seconds(self, share: Iterable[int]) -> float:
        """Approximate time (s) of one robot for these swaths, without run-in and run-out."""
        key = frozenset(share)
        if key not in self._known:
            part = _part_of(self.asked, sorted(key))
            self._known[key] = part.cost_of(ordered(part, kicks=KICKS)) if key else 0.0
        return self._known[key]

    def tour(self) -> list[int]:
        """Order all swaths by a rough tour of one robot."""
        return [int(self.asked.segment[node]) for node in ordered(self.asked, kicks=20 * KICKS)]


def _part_of(whole: Problem, chosen: Sequence[int]) -> Problem:
    """Restrict an ordering problem to some of its swaths."""
    nodes = np.flatnonzero(np.isin(whole.segment, chosen))
    place = np.zeros(len(whole.segment), dtype=np.int64)
    place[nodes] = np.arange(len(nodes))
    rows = np.append(nodes, whole.depot)
    return Problem(
        whole.cost[np.ix_(rows, rows)],
        np.searchsorted(np.array(chosen), whole.segment[nodes]),
        place[whole.flip[nodes]],
    )


def _points(swath: Swath) -> Floats:
    """Points (n, 2) along the lines of a swath, `_SAMPLE_M` apart."""
    rows = []
    for stroke in swath.strokes:
        station = np.linspace(0.0, stroke.nozzle.length_m, 2 + int(stroke.nozzle.length_m / _SAMPLE_M))
        rows.append(np.column_stack(stroke.nozzle.at(station)[:2]))
    return np.concatenate(rows)


def _near(points: Sequence[Floats]) -> NDArray[np.bool_]:
    from scipy.spatial import cKDTree

    trees = [cKDTree(each) for each in points]
    near = np.zeros((len(points), len(points)), dtype=np.bool_)
    for i, tree in enumerate(trees):
        for k in range(i):
            apart, _ = tree.query(points[k], distance_upper_bound=NEAR_M)
            near[i, k] = near[k, i] = bool(np.isfinite(apart).any())
    return near
