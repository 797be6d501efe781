"""Calibration drive: straights, turns and rests that tell a robot's constants apart.

Rests tell the gyro's bias, and turns between straights its scale. Opposite headings tell the antenna from a shift of
the map, and driving backward tells it from the stamp offset; rests at two headings do so without the wheels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import shapely

from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.vehicles import GNSS, Vehicle
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath
from touchline.services.planner.plan import Plan, finished
from touchline.services.planner.poses.traveller import TURN_SHARES, Traveller
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import Sent, send
from touchline.services.planner.speed.path_grid import course
from touchline.services.planner.speed.timing import speed_profile
from touchline.services.planner.steering.turns import ContinuousTurn

FIRST_REST_S: Final = 5.0
REST_S: Final = 2.0
_SPEED_MPS: Final = 0.5
"""Speed of a robot that turns on the spot: on its short lines there are too few fixes if it drives faster."""
CLEARANCE_M: Final = 0.3
"""Distance that the body keeps from the boundary and from obstacles: the robot is not calibrated yet."""
_SHORT_OF_TURN_M: Final = 0.01
"""Distance before a turn on the spot at which the robot rests: at the place itself it would turn first."""
_LINE_M: Final = 4.0
_SHORT_LINE_M: Final = 2.0
_STEP_M: Final = 0.1
_STEP_RAD: Final = 0.1

Stretch = tuple[Piece, ...]
"""Pieces between two rests."""


class PlannedRest(NamedTuple):
    """Rest of a robot under way.

    Attributes:
        at_m: Arc length, m.
        time_s: Time for which it is to stand, s.
    """

    at_m: float
    time_s: float


class NeededSpace(NamedTuple):
    """Ground that a drive needs, as a rectangle along the start's heading, clearance included.

    Attributes:
        behind_m, ahead_m, right_m, left_m: Distances of its sides from the start, m.
    """

    behind_m: float
    ahead_m: float
    right_m: float
    left_m: float

    def __str__(self) -> str:
        """Return the size, and where it lies."""
        length_m, width_m = self.behind_m + self.ahead_m, self.right_m + self.left_m
        return (
            f"{length_m:.1f} m × {width_m:.1f} m of free ground, {self.behind_m:.1f} m behind the start, "
            f"{self.ahead_m:.1f} m ahead, {self.left_m:.1f} m to the left and {self.right_m:.1f} m to the right"
        )


class CalibrationDrive(NamedTuple):
    """Planned calibration drive.

    Attributes:
        plan: The plan.
        rests: Rests along it, in their order.
        space: Ground that it needs.
        cause: Inputs of the plan, for the recording.
    """

    plan: Plan
    rests: tuple[PlannedRest, ...]
    space: NeededSpace
    cause: PlanCause

    @property
    def time_s(self) -> float:
        """Time that it takes, rests included."""
        return self.plan.report.total_time_s + sum(rest.time_s for rest in self.rests)


def plan_calibration(
    vehicle: Vehicle, start: Sequence[float] = (0.0, 0.0, 0.0), ground: KnownGround = OPEN_GROUND
) -> CalibrationDrive:
    """Plan the calibration drive of a vehicle: straights and turns on the spot, or loops to both sides.

    Args:
        vehicle: The vehicle.
        start: x (m), y (m), heading (rad) of the start, map frame.
        ground: Boundary and obstacles.

    Raises:
        PlanningError: The vehicle has no GNSS receiver, or the ground is not free.
    """
    if vehicle.positioning != GNSS:
        raise PlanningError(
            "", f"is of a robot with the positioning {vehicle.positioning!r}", "calibrate robots with a GNSS receiver"
        )
    most_mps = min(_SPEED_MPS, vehicle.drive.transit_speed_mps) if vehicle.drive.can_spin else 0.0
    traveller, pose = Traveller.of(vehicle, PlanOptions(transit_speed_mps=most_mps)), PathPose(*start)
    limits, sections = traveller.limits, list[Section]()
    for stretch in _stretches(traveller):
        sections.append(Section(TRANSITION, PiecePath(pose, stretch)))
        pose = sections[-1].path.end
    space = _checked_space(sections, vehicle, ground)
    sent = send(sections, lambda done: None, curvature_max_1pm=limits.drive.curvature_max_1pm)
    speeds = speed_profile(course(sections, sent, (), limits), (), limits)
    plan = finished(WorkedRoute(sections), sent, [], speeds, vehicle, limits)
    cause = PlanCause(options=PlanOptions(start=np.array(start)), ground=ground, calibration=True)
    return CalibrationDrive(plan, _rests(sections, sent), space, cause)


def _stretches(traveller: Traveller) -> list[Stretch]:
    """Return what the vehicle drives between rests, as far as it can turn on the spot and drive backward."""
    line, back, half_turn = Piece(_LINE_M), Piece(_LINE_M, direction=-1), Piece.spin(math.pi)
    if traveller.can_spin and traveller.can_reverse:
        short, short_back = Piece(_SHORT_LINE_M), Piece(_SHORT_LINE_M, direction=-1)
        first = [(short,), (half_turn,), (short_back,), (Piece.spin(-math.pi),)]
        return [*first, (line,), (back,), (half_turn, half_turn), (line,), (Piece.spin(-math.tau),), (back,)]
    limits = traveller.limits
    turn = ContinuousTurn(*limits.turn_at(TURN_SHARES[2] * limits.transit_speed_mps))
    to_left = turn.pieces(math.tau)
    to_right = tuple(piece.mirrored() for piece in to_left)
    between = [(back,)] if traveller.can_reverse else []
    return [(line,), *between, (line, *to_left, line), *between, (line, *to_right, line), *between]


def _rests(sections: Sequence[Section], sent: Sequence[Sent]) -> tuple[PlannedRest, ...]:
    """Return a rest before each section; one between turns on the spot alone has no arc length of its own."""
    rests, ideal_m = [PlannedRest(0.0, FIRST_REST_S)], 0.0
    for section, following in pairwise(sections):
        ideal_m += section.path.length_m
        at_m = max(each.end_m for each in sent if each.ideal_to_m <= ideal_m + 1e-9)
        turns = following.path.pieces[0].spin_rad != 0.0
        rests.append(PlannedRest(at_m - _SHORT_OF_TURN_M if turns else at_m, REST_S))
    return tuple(rests)


def _checked_space(sections: Sequence[Section], vehicle: Vehicle, ground: KnownGround) -> NeededSpace:
    """Return the ground that a drive needs.

    Raises:
        PlanningError: It is not free.
    """
    start, body = sections[0].path.start, np.array(vehicle.body.footprint_m)
    bodies = [_placed(body, pose) for section in sections for pose in _poses(section.path)]
    hulls = shapely.convex_hull(shapely.multipolygons(list(pairwise(bodies))))
    swept = shapely.union_all(hulls).buffer(CLEARANCE_M)
    outline = np.asarray(shapely.get_coordinates(swept)) - (start.x_m, start.y_m)
    ahead = outline @ (math.cos(start.heading_rad), math.sin(start.heading_rad))
    left = outline @ (-math.sin(start.heading_rad), math.cos(start.heading_rad))
    space = NeededSpace(*(float(each) for each in (-ahead.min(), ahead.max(), -left.min(), left.max())))
    for obstacle in ground.obstacles:
        if shapely.Polygon(obstacle.corners, obstacle.holes).intersects(swept):
            raise _not_free(space, f'"{obstacle.id}" is in the way')
    if ground.boundary is not None and not shapely.Polygon(ground.boundary).contains(swept):
        raise _not_free(space, "it reaches beyond the boundary")
    return space


def _not_free(space: NeededSpace, why: str) -> PlanningError:
    return PlanningError("", f"needs {space}, and {why}", "give another start pose")


def _poses(path: PiecePath) -> Floats:
    """Return (n, 3) poses along a path, turns on the spot first if it begins with them."""
    along = np.linspace(0.0, path.length_m, 2 + math.ceil(path.length_m / _STEP_M))
    return np.concatenate((path.spun(_STEP_RAD), np.column_stack(path.sample(along)[:3])))


def _placed(body: Floats, pose: Floats) -> shapely.Polygon:
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    return shapely.Polygon(body @ np.array([[cos, sin], [-sin, cos]]) + pose[:2])
