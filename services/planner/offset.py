"""From what the nozzle shall paint to what the robot's centre shall drive."""

from dataclasses import dataclass

from schemas.curves import Curve
from schemas.errors import PlanningError
from schemas.template import TemplateSegment
from schemas.vehicle import Vehicle
from services.planner.clothoid import Piece, PiecePath, Pose
from services.planner.method import CurveEnd

# Rounding may put an arc at exactly the largest curvature a little above it.
CURVATURE_SLACK = 1e-9


@dataclass(frozen=True)
class Stroke:
    """A template segment as it will be painted: the nozzle's and the robot's curve, in the direction of travel."""

    id: str
    label: str
    actuation: str
    nozzle: Curve
    robot: Curve
    flipped: bool

    @property
    def begin(self) -> CurveEnd:
        """Robot pose and curvature where painting begins."""
        return CurveEnd(Pose(self.robot.x_m, self.robot.y_m, self.robot.heading_rad), self.robot.curvature_1pm)

    @property
    def end(self) -> CurveEnd:
        """Robot pose and curvature where painting ends."""
        return CurveEnd(Pose(*self.robot.end), self.robot.curvature_1pm)

    @property
    def path(self) -> PiecePath:
        """The robot's curve as a path of one piece."""
        return PiecePath(self.begin.pose, (Piece(self.robot.length_m, self.robot.curvature_1pm),))


def strokes(segments: tuple[TemplateSegment, ...], vehicle: Vehicle, curvature_max_1pm: float) -> list[Stroke]:
    """Every segment in the template's order, turned round where only the other direction can be driven.

    Raises:
        PlanningError: The nozzle is not on the axle, two segments share an id, or an arc cannot be driven at all.
    """
    if vehicle.nozzle_x_m != 0.0:
        raise PlanningError(
            "",
            f"has a nozzle {vehicle.nozzle_x_m:g} m ahead of the axle",
            "use a vehicle with nozzle_x_m = 0: only a nozzle beside the axle keeps arcs arcs",
        )
    seen: set[str] = set()
    for segment in segments:
        if segment.id in seen:
            raise PlanningError(segment.id, "appears twice", "give every segment an id of its own")
        seen.add(segment.id)
    return [_stroke(segment, vehicle.nozzle_y_m, curvature_max_1pm) for segment in segments]


def _stroke(segment: TemplateSegment, nozzle_left_m: float, curvature_max_1pm: float) -> Stroke:
    given = segment.curve()
    for nozzle, flipped in ((given, False), (given.reversed(), True)):
        robot = _drivable(nozzle, nozzle_left_m, curvature_max_1pm)
        if robot is not None:
            return Stroke(segment.id, segment.label, segment.actuation, nozzle, robot, flipped)
    smallest = max(1.0 / curvature_max_1pm - abs(nozzle_left_m), 0.0)
    raise PlanningError(
        segment.id,
        f"has a radius of {1.0 / abs(given.curvature_1pm):.3f} m, too tight for the robot in either direction",
        f"use a radius of at least {smallest:.3f} m, or a kappa_max above {curvature_max_1pm:g} 1/m",
    )


def _drivable(nozzle: Curve, nozzle_left_m: float, curvature_max_1pm: float) -> Curve | None:
    """The robot's curve while its nozzle, `nozzle_left_m` to its left, follows `nozzle`; None if it is too tight."""
    if nozzle.curvature_1pm * -nozzle_left_m >= 1.0:
        return None
    robot = nozzle.offset(-nozzle_left_m)
    return robot if abs(robot.curvature_1pm) <= curvature_max_1pm * (1.0 + CURVATURE_SLACK) else None
