"""Tasks of a team: spread over the area, drive to lists of goals, or change places across a circle."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import ROBOT_RADIUS_M
from touchline.coordination.coverage import TeamCoverage, coverage_of
from touchline.coordination.density import Density, density_of
from touchline.coordination.free_area import FreeArea
from touchline.coordination.lloyd import EVEN
from touchline.schemas.errors import SpecError
from touchline.schemas.team import DeployTask, FormationTask, PlainTaskSpec, SwapTask

Floats = NDArray[np.float64]

ARRIVED_M: Final = 0.1


class TeamTask(Protocol):
    """Assigns goals to robots, from where they are."""

    @property
    def last(self) -> Mapping[str, tuple[float, float]]:
        """Last goal of each robot that has one (m, map frame)."""
        ...

    @property
    def ends_on_arrival(self) -> bool:
        """True if the task ends when all robots are at their last goals."""
        ...

    @property
    def density(self) -> Density:
        """φ."""
        ...

    @property
    def coverage(self) -> TeamCoverage | None:
        """Rule by which the team spreads; None: it does not."""
        ...

    def goals(self, names: Sequence[str], states: Floats) -> Floats:
        """Return the goal of each robot; to be called once per update.

        Args:
            names: Names of n robots.
            states: (n, 4) x, y (m, map frame), heading (rad), speed (m/s).

        Returns:
            (n, 2) m, map frame; not necessarily within reach.
        """
        ...


class Deploy:
    """Task: spread over the area, by Lloyd's rule."""

    last: Mapping[str, tuple[float, float]] = MappingProxyType({})
    ends_on_arrival = False

    def __init__(self, area: FreeArea, density: Density = EVEN, wall_m: float = ROBOT_RADIUS_M) -> None:
        """Spread over an area.

        Args:
            area: The area.
            density: φ.
            wall_m: Distance that robots keep from walls.
        """
        self.density = density
        self.coverage: TeamCoverage = coverage_of(area, density, wall_m)

    def goals(self, names: Sequence[str], states: Floats) -> Floats:
        """Return goals, as of `TeamTask`.

        Raises:
            CoincidentPoints: Two robots are at the same place.
        """
        return self.coverage.goals(np.ascontiguousarray(states[:, :2]))


class GoalLists:
    """Task: each robot drives to its goals in turn, and stays at the last; one that has none stays where it is."""

    ends_on_arrival = True
    density = EVEN
    coverage = None

    def __init__(self, goals: Mapping[str, Sequence[tuple[float, float]]]) -> None:
        """Set the goals (m, map frame) of each robot by its name."""
        self._left = {name: list(places) for name, places in goals.items()}

    @property
    def last(self) -> dict[str, tuple[float, float]]:
        """Last goal of each robot (m, map frame)."""
        return {name: left[-1] for name, left in self._left.items() if left}

    def goals(self, names: Sequence[str], states: Floats) -> Floats:
        """Return goals, as of `TeamTask`."""
        places = states[:, :2]
        return np.array([self._goal(name, place) for name, place in zip(names, places, strict=True)]).reshape(-1, 2)

    def _goal(self, name: str, place: Floats) -> Floats:
        left = self._left.get(name)
        if not left:
            return place
        while len(left) > 1 and np.hypot(*(np.array(left[0]) - place)) <= ARRIVED_M:
            left.pop(0)
        return np.array(left[0])


def swap(places: Mapping[str, tuple[float, float]]) -> GoalLists:
    """Return goals that swap every robot to the opposite place, across the middle of all.

    Args:
        places: Place of each robot, by its name (m, map frame).
    """
    x, y = np.array([places[name] for name in sorted(places)]).mean(axis=0)
    return GoalLists({name: [(2.0 * x - at[0], 2.0 * y - at[1])] for name, at in places.items()})


def in_formation(spec: FormationTask, places: Mapping[str, tuple[float, float]]) -> GoalLists:
    """Assign robots to the places of a formation, with the least sum of squared distances.

    Args:
        spec: The formation.
        places: Place of each robot, by its name (m, map frame).
    """
    from scipy.optimize import linear_sum_assignment

    names = sorted(places)
    wanted = _formation(spec, len(names))
    here = np.array([places[name] for name in names])
    _, chosen = linear_sum_assignment(((here[:, None] - wanted[None]) ** 2).sum(axis=2))
    return GoalLists({name: [(float(x), float(y))] for name, (x, y) in zip(names, wanted[chosen], strict=True)})


def _formation(spec: FormationTask, count: int) -> Floats:
    """Return (count, 2) places of the formation (m, map frame)."""
    number = np.arange(count, dtype=np.float64)
    if spec.shape == "line":
        own = np.column_stack(((number - 0.5 * (count - 1)) * spec.apart_m, np.zeros(count)))
    elif spec.shape == "circle":
        radius_m = 0.5 * spec.apart_m / np.sin(np.pi / count) if count > 1 else 0.0
        angle = 2.0 * np.pi * number / count
        own = radius_m * np.column_stack((np.cos(angle), np.sin(angle)))
    else:
        across = int(np.ceil(np.sqrt(count)))
        own = spec.apart_m * np.column_stack((number % across, number // across))
        own -= 0.5 * (own.min(axis=0) + own.max(axis=0))
    cos, sin = np.cos(spec.heading_rad), np.sin(spec.heading_rad)
    turned: Floats = own @ np.array(((cos, sin), (-sin, cos))) + np.array((spec.x_m, spec.y_m))
    return turned


def task_of(
    spec: PlainTaskSpec, area: FreeArea, places: Mapping[str, tuple[float, float]], wall_m: float = ROBOT_RADIUS_M
) -> TeamTask:
    """Return the task of a specification.

    Args:
        spec: The specification.
        area: The area.
        places: Place of each robot, by its name (m, map frame).
        wall_m: Distance that robots keep from walls.

    Raises:
        SpecError: It names an unknown robot.
    """
    if isinstance(spec, DeployTask):
        return Deploy(area, density_of(spec.importance), wall_m)
    if isinstance(spec, SwapTask):
        return swap(places)
    if isinstance(spec, FormationTask):
        return in_formation(spec, places)
    for name in spec.goals:
        if name not in places:
            raise SpecError("team", f"task.goals.{name}", "is no robot of the team", f"use {', '.join(sorted(places))}")
    return GoalLists(spec.goals)
