"""Start poses of a team without given ones: close together in a corner, or on a circle."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.core.random import STREAM_TEAM_START, uniform
from touchline.schemas.errors import SpecError
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import PLACE_M2, SwapTask, TeamArea, TeamScenario

Floats = NDArray[np.float64]

# Ticks of random numbers: headings, and places on a circle.
_HEADING: Final = 0
_ON_CIRCLE: Final = 1
# Additional distances (m) of a start grid from walls and between robots.
_OFF_WALL_M: Final = 0.1
_APART_M: Final = 0.08
# Least radius of a circle of robots that change places, and their spacing, in clearance radii.
_CIRCLE_M: Final = 1.5
_ON_CIRCLE_APART: Final = 4.0
_AMISS: Final = 0.05  # by which share of that a robot may stand off its even place


def free_area(team: TeamScenario) -> FreeArea:
    """Return the area of a team; by default a square.

    Raises:
        SpecError: The area is invalid.
    """
    area = team.area or _square(_side_m(team))
    return FreeArea.of(area.outline, area.obstacles)


def start_poses(team: TeamScenario, area: FreeArea) -> dict[str, Pose2]:
    """Return the start pose of each robot, by its name.

    Raises:
        SpecError: They do not fit.
    """
    if team.places:
        _check_places(team, area)
        return dict(team.places)
    on_circle = isinstance(team.task, SwapTask)
    places = _circle(team, area) if on_circle else _corner(team, area)
    seed = team.world.seed
    turns = [math.tau * (uniform(seed, STREAM_TEAM_START, _HEADING, k) - 0.5) for k in range(len(places))]
    rows = zip(_by_number(team.names), places.tolist(), turns, strict=True)
    return {name: Pose2(x_m=x, y_m=y, heading_rad=turn) for name, (x, y), turn in rows}


def _by_number(names: tuple[str, ...]) -> list[str]:
    """Sort `tb2` before `tb10`."""
    return sorted(names, key=lambda name: (len(name), name))


def _side_m(team: TeamScenario) -> float:
    count = len(team.names)
    if isinstance(team.task, SwapTask) and not team.places:
        return 2.0 * (_circle_m(team) + 5.0 * team.radius_m)
    if team.places:
        return max(math.sqrt(PLACE_M2 * count), *(max(at.x_m, at.y_m) + 1.0 for at in team.places.values()))
    return math.sqrt(PLACE_M2 * count)


def _square(side_m: float) -> TeamArea:
    return TeamArea(outline=((0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)))


def _circle_m(team: TeamScenario) -> float:
    return max(_CIRCLE_M, _ON_CIRCLE_APART * team.radius_m * len(team.names) / math.tau)


def _circle(team: TeamScenario, area: FreeArea) -> Floats:
    """Return (n, 2) places on a circle about the middle of the area, each slightly off its even place."""
    count, seed = len(team.names), team.world.seed
    number = np.arange(count)
    off = _AMISS * np.array([2.0 * uniform(seed, STREAM_TEAM_START, _ON_CIRCLE, k) - 1.0 for k in range(count)])
    angle = math.tau * (number + off) / count
    middle = 0.5 * (area.hull.min(axis=0) + area.hull.max(axis=0))
    found: Floats = middle + _circle_m(team) * np.column_stack((np.cos(angle), np.sin(angle)))
    if not area.holds(found, team.radius_m).all():
        raise SpecError("team", "area", "is too small for the robots to stand on a circle", "give a larger one")
    return found


def _corner(team: TeamScenario, area: FreeArea) -> Floats:
    """Return (n, 2) places of a square grid, the nearest to the area's corner of least x and y."""
    count, pitch_m = len(team.names), 2.0 * team.radius_m + _APART_M
    low, high = area.hull.min(axis=0), area.hull.max(axis=0)
    across, up = (int(n) + 1 for n in (high - low) / pitch_m)
    column, row = (grid.ravel() for grid in np.meshgrid(np.arange(across), np.arange(up)))
    places = low + team.radius_m + _OFF_WALL_M + pitch_m * np.column_stack((column, row))
    free = np.flatnonzero(area.holds(places, team.radius_m))
    if len(free) < count:
        problem = f"has room for {len(free)} robots in a grid of {pitch_m:.2f} m, not for {count}"
        raise SpecError("team", "area", problem, "give a larger one, fewer robots, or their places")
    order = np.lexsort((column[free], row[free], np.maximum(column[free], row[free])))
    found: Floats = places[free[order[:count]]]
    return found


def _check_places(team: TeamScenario, area: FreeArea) -> None:
    """Check that all stand in the area, and no two touch.

    Raises:
        SpecError: They do not; the message names the robots.
    """
    names = team.names
    places = np.array([(team.places[name].x_m, team.places[name].y_m) for name in names])
    outside = np.flatnonzero(~area.holds(places, 0.0))
    if len(outside):
        raise SpecError("team", f"places.{names[outside[0]]}", "is outside the area", "move it inside")
    for k, name in enumerate(names):
        apart = np.hypot(*(places[k + 1 :] - places[k]).T)
        if len(apart) and apart.min() < team.radius_m:
            other = names[k + 1 + int(apart.argmin())]
            problem = f"is {apart.min():.2f} m from that of {other}"
            raise SpecError("team", f"places.{name}", problem, "move them apart by the bodies at least")
