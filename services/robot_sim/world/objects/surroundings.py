"""Surroundings of a robot: the objects of its scenario and the obstacles of its job."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.affinity import rotate, translate

from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.errors import CommandRefused
from touchline.schemas.scenario import Scenario
from touchline.schemas.scenario_objects import FollowPath, Intercept, Motion, ScenarioObject, StepInFront, Wander
from touchline.schemas.sensor_names import BUMPER_STRIP
from touchline.schemas.template import Polygon
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.objects import things as t
from touchline.services.robot_sim.world.objects.contacts import MOST_POINTS, POINT_COLUMNS
from touchline.services.robot_sim.world.objects.solids import solid_grid

Floats = NDArray[np.float64]
Corners = Sequence[tuple[float, float]]

OBSTACLE_HEIGHT_M: Final = 1.0
"""Height of a template's obstacles, which say nothing of it."""
_TOUCHING_M: Final = 0.01
"""Depth to which a body that is put down may reach into something: it touches."""

_MOTIONS: Final = {
    "still": t.STILL,
    "path": t.PATH,
    "wander": t.WANDER,
    "step-in-front": t.STEP_IN_FRONT,
    "intercept": t.INTERCEPT,
}


class Contact(NamedTuple):
    """A contact of the robot with a thing.

    Attributes:
        tick: Tick in which it began.
        thing: Name of the thing.
        east_m: Place, map frame.
        north_m: Place, map frame.
        robot_mps: Speed of the robot's body there; 0 if the thing ran into the robot at rest.
        closing_mps: Speed of both together.
        energy_j: Energy that the contact took.
    """

    tick: int
    thing: str
    east_m: float
    north_m: float
    robot_mps: float
    closing_mps: float
    energy_j: float


class Surroundings:
    """Objects and obstacles around a robot.

    Attributes:
        things: Arrays for kernels.
        vehicle: The robot.
        strips: Names of its bumper strips, in the order of `Things.pressed_n`.
    """

    things: t.Things

    def __init__(self, vehicle: Vehicle, scenario: Scenario, centre_x_m: float) -> None:
        """Place the objects of a scenario round a vehicle whose centre of mass is so far ahead of its origin."""
        self._named = [(each.name or f"{each.kind} {n}", each) for n, each in enumerate(scenario.objects)]
        moving = [(n, each) for n, each in enumerate(scenario.objects) if each.movable_kg]
        points: list[tuple[float, float]] = []
        figures = [_figures(number, each, points) for number, each in moving]
        self._movers: Floats = np.zeros((len(moving), t.MOVER_COLUMNS))
        for row, (_, each) in zip(self._movers, moving, strict=True):
            row[[t.EAST, t.NORTH]] = row[[t.TARGET_EAST, t.TARGET_NORTH]] = each.x_m, each.y_m
        self._figures: Floats = np.array(figures, dtype=np.float64).reshape(-1, t.MOVER_FIGURES)
        self._points: Floats = np.array(points, dtype=np.float64).reshape(-1, 2)
        self._outline = _outline(vehicle.body.footprint_m)
        self._reach_m = float(np.hypot(*self._outline[:, :2].T).max())
        self._centre_x_m = centre_x_m
        strips = [each for each in vehicle.sensors if each.kind == BUMPER_STRIP]
        self.vehicle, self.strips = vehicle, tuple(each.name for each in strips)
        rows = [(each.from_m, each.to_m, each.least_n) for each in strips]
        self._strips: Floats = np.array(rows, dtype=np.float64).reshape(-1, 3)
        self._trail: Floats = np.zeros((t.POSES, 3))
        self.surround(())

    def surround(self, obstacles: Iterable[Polygon]) -> None:
        """Put the obstacles of a job beside the objects, instead of those of the job before; forget former contacts.

        Args:
            obstacles: Obstacles of the job's template.
        """
        known = [_fixed(name, each) for name, each in self._named if not each.movable_kg]
        known += [_Fixed(each.id, each.corners, None, OBSTACLE_HEIGHT_M, dark=False, soft=False) for each in obstacles]
        hard = [each for each in known if not each.soft]
        self._names = [each.name for each in hard] + [name for name, each in self._named if each.movable_kg]
        rows, soft = [], []
        for each in known:
            edges = each.edges()
            rows += edges
            soft += [float(each.soft)] * len(edges)
        outlines = [_ccw(each.corners) for each in hard]
        vertices = [corner for outline in outlines for corner in outline]
        number = len(hard) + len(self._movers)
        self.things = t.Things(
            grid=solid_grid(rows),
            soft=np.array(soft, dtype=np.float64),
            fixed=np.array([each.bounds() for each in hard], dtype=np.float64).reshape(-1, t.FIXED_COLUMNS),
            first=np.cumsum([0, *map(len, outlines)], dtype=np.int64),
            vertices=np.array(vertices, dtype=np.float64).reshape(-1, 2),
            movers=self._movers,
            figures=self._figures,
            points=self._points,
            wanted=np.zeros((len(self._movers), 2)),
            near=np.zeros(number, np.int64),
            marks=np.zeros(t.MARKS, np.int64),
            clear=np.zeros(1),
            log=np.zeros((t.MOST_NEW, t.CONTACT_COLUMNS)),
            touched=np.zeros((number, 3), np.int64),
            outline=self._outline,
            reach_m=self._reach_m,
            centre_x_m=self._centre_x_m,
            strips=self._strips,
            pressed_n=np.zeros(len(self._strips) + 1),
            contacts=np.zeros((MOST_POINTS, POINT_COLUMNS)),
            motion=np.zeros(3),
            trail=self._trail,
        )

    def carry(self, pose: tuple[float, float, float]) -> None:
        """Take note that the robot was carried to a pose: it has been there for all that sensors know."""
        self._trail[:] = pose
        self.things.clear[0] = 0.0

    def check_room(self, pose: Sequence[float], obstacles: Iterable[Polygon]) -> None:
        """Check that the body can be put down at a pose.

        Args:
            pose: East, north and heading, map frame.
            obstacles: Obstacles of the job's template.

        Raises:
            CommandRefused: Something hard stands there.
        """
        east_m, north_m, heading_rad = pose
        turned = rotate(shapely.Polygon(self.vehicle.body.footprint_m), heading_rad, (0.0, 0.0), use_radians=True)
        body = translate(turned, east_m, north_m).buffer(-_TOUCHING_M)
        shapes, rows = [], iter(self._movers)
        for name, each in self._named:
            fixed = _fixed(name, each)
            row = next(rows) if each.movable_kg else None
            disc = fixed.disc if row is None else (row[t.EAST], row[t.NORTH], each.disc_m)
            if not fixed.soft:
                shapes.append((name, _ground(each.corners, disc)))
        shapes += [(each.id, shapely.Polygon(each.corners)) for each in obstacles]
        for name, shape in shapes:
            if shape.intersects(body):
                raise CommandRefused(
                    f'the robot would begin at ({east_m:.2f}, {north_m:.2f}), where "{name}" stands: move that in the'
                    " scenario or template, or give the scenario another start"
                )

    def new_contacts(self, tick: int) -> list[Contact]:
        """Return the contacts that began in a tick.

        Args:
            tick: The last tick.
        """
        count = int(self.things.marks[t.NEW_CONTACTS])
        return [
            Contact(tick, self._names[int(row[t.C_THING])], *row[t.C_EAST :].tolist())
            for row in self.things.log[:count]
        ]


class _Fixed(NamedTuple):
    name: str
    corners: Corners
    disc: tuple[float, float, float] | None
    height_m: float
    dark: bool
    soft: bool

    def edges(self) -> list[tuple[float, ...]]:
        """Return its rows in a grid of solids."""
        figures = self.height_m, float(self.dark)
        if self.disc is not None:
            x, y, radius = self.disc
            return [(x, y, x, y, radius, *figures)]
        corners = _ccw(self.corners)
        return [(*a, *b, 0.0, *figures) for a, b in pairwise((*corners, corners[0]))]

    def bounds(self) -> tuple[float, ...]:
        """Return its row of `Things.fixed`."""
        if self.disc is not None:
            x, y, radius = self.disc
            return x, y, radius, radius
        corners = np.array(self.corners)
        centre = 0.5 * (corners.min(0) + corners.max(0))
        return *centre.tolist(), float(np.hypot(*(corners - centre).T).max()), 0.0


def _fixed(name: str, thing: ScenarioObject) -> _Fixed:
    disc = (thing.x_m, thing.y_m, thing.disc_m) if thing.disc_m else None
    return _Fixed(name, thing.corners, disc, thing.tall_m, thing.dark, thing.yields)


def _ground(corners: Corners, disc: tuple[float, float, float] | None) -> shapely.Polygon:
    """Return the ground that a thing stands on."""
    return shapely.Polygon(corners) if disc is None else shapely.Point(disc[:2]).buffer(disc[2])


def _ccw(corners: Corners) -> list[tuple[float, float]]:
    """Return the corners of an outline counter-clockwise."""
    doubled = math.fsum(xa * yb - xb * ya for (xa, ya), (xb, yb) in pairwise((*corners, *corners[:1])))
    return list(corners) if doubled >= 0.0 else list(reversed(corners))


def _outline(footprint: Corners) -> Floats:
    """Return a robot's corners counter-clockwise, each with the way along the outline as given to it and the next."""
    ways = np.cumsum([0.0, *(math.dist(a, b) for a, b in pairwise((*footprint, footprint[0])))])
    rows = np.column_stack((np.array(footprint, dtype=np.float64), ways[:-1], ways[1:]))
    if _ccw(footprint) == list(footprint):
        return rows
    return np.column_stack((np.roll(rows[:, :2], -1, 0)[::-1], rows[::-1, 3], rows[::-1, 2]))


def _figures(number: int, thing: ScenarioObject, points: list[tuple[float, float]]) -> list[float]:
    """Return the constants of a mover; its points are added to `points`."""
    motion: Motion = thing.motion
    row = [0.0] * t.MOVER_FIGURES
    row[t.M_RADIUS], row[t.M_HEIGHT] = thing.disc_m, thing.tall_m
    row[t.M_DARK], row[t.M_SOFT] = float(thing.dark), float(thing.yields)
    row[t.M_MASS], row[t.M_HOLD] = thing.movable_kg, thing.figures.hold_mps2
    row[t.M_MOTION], row[t.M_FIRST], row[t.M_NUMBER] = _MOTIONS[motion.kind], len(points), number
    if isinstance(motion, FollowPath):
        points += motion.points
        row[t.M_POINTS], row[t.M_LOOP] = len(motion.points), float(motion.loop)
    elif isinstance(motion, Wander):
        points += (motion.corner, motion.opposite)
    elif isinstance(motion, StepInFront):
        row[t.M_NEAR], row[t.M_AHEAD], row[t.M_BEYOND] = motion.near_m, motion.ahead_m, motion.beyond_m
    elif isinstance(motion, Intercept):
        row[t.M_NEAR] = motion.near_m
    if isinstance(motion, FollowPath | Intercept):
        row[t.M_START] = round(motion.start_s * TICKS_PER_S)
    if motion.kind != "still":
        row[t.M_SPEED] = motion.speed_mps
    return row
