"""Request for a plan of the rest of a job, from where its robot stands and round what it has seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from touchline.core.robust_overlay import as_area, buffer, difference, union_of_two
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import TICK_S
from touchline.onboard.perception.perception import lidars_of
from touchline.onboard.protection.stopping import stopping_with
from touchline.schemas.ground_piece import RemainingPieces
from touchline.schemas.known_ground import KnownGround, KnownObstacle
from touchline.schemas.messages import PlanOptions, PlanReport
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.standing_clearance import HIT_ERROR_M
from touchline.schemas.template import Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.grown_outlines import body_at, grown
from touchline.services.robot_sim.way_round.remains import Rest

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Pose = tuple[float, float, float]

NEAR_M: Final = 1.0
"""Distance from it within which it may pass things as near as it stands to them: else it could not leave."""
SIMPLER_M: Final = 0.005
"""Rounding of outlines."""
OFF_PATH_M: Final = 0.1
"""Allowance for the robot's distance from its path."""
PASSING_MPS: Final = 0.2
"""Speed at which the robot can pass a thing beside its way."""


class RestRequest(NamedTuple):
    """The rest of a job, to be planned.

    Attributes:
        rest: The rest, with the outlines of the job's own template.
        seen: What the robot has seen, with the distance that it keeps.
        options: Options of the plan, with the robot's pose as its start.
    """

    rest: Rest
    seen: tuple[Polygon, ...]
    options: PlanOptions

    @property
    def template(self) -> Template:
        """Template to plan: the rest, with what was seen as further obstacles."""
        obstacles = (*self.rest.template.obstacles, *self.seen)
        return self.rest.template.model_copy(update={"obstacles": obstacles})

    @property
    def remaining_json(self) -> str:
        """Remaining pieces of areas as text; "" if there are none."""
        return RemainingPieces(pieces=self.rest.pieces).model_dump_json() if self.rest.pieces else ""

    def cause(self, report: PlanReport) -> PlanCause:
        """Return the inputs of the plan besides the rest, by the plan's report."""
        seen = tuple(KnownObstacle(id=each.id, corners=each.corners) for each in self.seen)
        update = {"ground": KnownGround(obstacles=seen), "remaining": self.rest.pieces}
        return PlanCause.of(self.options, report).model_copy(update=update)


def with_margin(
    seen: Sequence[Polygon], pose: Pose, vehicle: Vehicle, kept_m: float, left_m: float, farther_m: float = 0.0
) -> tuple[Polygon, ...]:
    """Return outlines with the distance that a robot keeps from them, without the ground on which it stands.

    That is free, even if an outline, which is the hull of what was seen, covers it; one that lies all round the robot
    is open towards where it has come from. Near the robot the distance is at most what it has at present.

    Args:
        seen: The outlines.
        pose: x (m), y (m), heading (rad) of the standing robot, map frame.
        vehicle: The robot.
        kept_m: The distance.
        left_m: Distance from the standing robot that is taken as free; at its corners more, as on the planner's map.
        farther_m: Distance by which it keeps farther off near it than at present.
    """
    import shapely

    body, found = body_at(pose, vehicle), list[Polygon]()
    room, near = buffer(body, left_m, join_style="mitre"), buffer(body, NEAR_M)
    for each in seen:
        shape = shapely.Polygon(each.corners)
        least_m = min(max(float(shape.distance(body)) - left_m, 0.0) + farther_m, kept_m)
        beyond = difference(shapely.Polygon(grown(each.id, shape, kept_m).corners), near)
        kept = union_of_two(buffer(shape, least_m, quad_segs=4), beyond)
        outline = as_area(difference(kept, room))
        if any(part.interiors for part in shapely.get_parts(outline)):
            outline = as_area(difference(kept, _way_back(room, pose, kept.length)))
        parts = shapely.get_parts(outline)
        if not outline.is_empty:
            main = shapely.simplify(min(parts, key=lambda part: float(part.distance(shape))), SIMPLER_M)
            corners = shapely.get_coordinates(main.exterior)[:-1].tolist()
            found.append(Polygon(id=each.id, corners=tuple((x, y) for x, y in corners)))
    return tuple(found)


def _way_back(room: BaseGeometry, pose: Pose, by_m: float) -> BaseGeometry:
    """Return the ground on which a robot stands, and a way from there straight back, from where it has come."""
    from shapely.affinity import translate

    return room.union(translate(room, -by_m * math.cos(pose[2]), -by_m * math.sin(pose[2]))).convex_hull


def passing_m(vehicle: Vehicle, braking_mps2: float) -> float:
    """Return the distance from a thing at which protection lets a robot pass it at `PASSING_MPS`.

    Args:
        vehicle: The robot.
        braking_mps2: Deceleration that its protection counts on.
    """
    return vehicle.protection.margin_m + OFF_PATH_M + HIT_ERROR_M + coming_m(vehicle, braking_mps2, PASSING_MPS)


def coming_m(vehicle: Vehicle, braking_mps2: float, speed_mps: float) -> float:
    """Return how much nearer a thing may come, as protection counts on, while a robot stops.

    Args:
        vehicle: The robot.
        braking_mps2: Deceleration that its protection counts on.
        speed_mps: Speed from which it stops.
    """
    rules = vehicle.protection
    thing_mps = rules.thing_speed_mps if rules.mode == "passive" else 0.0
    stopping = stopping_with(braking_mps2, drive_of(vehicle).lag_s)
    late_s = max((2.0 / each.rate_hz + each.latency_s for each in lidars_of(vehicle)), default=0.0) + TICK_S
    return thing_mps * (late_s + stopping.reaction_s + speed_mps / braking_mps2 + stopping.creep_s)
