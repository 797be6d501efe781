"""From what the nozzle shall paint to what the robot's centre shall drive."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from schemas.curves import Curve, wrap_angle
from schemas.errors import PlanningError
from schemas.template import TemplateSegment
from schemas.vehicle import Vehicle
from services.planner.clothoid import Piece, PiecePath, Pose
from services.planner.transitions.method import CurveEnd

# Rounding may put an arc at exactly the largest curvature a little above it.
CURVATURE_SLACK = 1e-9
# An arc this close to a full turn is a circle, and may begin at any of so many points.
FULL_TURN_RAD = 1e-6
CIRCLE_STARTS = 8
_BOTH_WAYS: tuple[tuple[bool, Callable[[Curve], Curve]], ...] = ((False, lambda c: c), (True, lambda c: c.reversed()))


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


def modes(
    segments: tuple[TemplateSegment, ...], vehicle: Vehicle, curvature_max_1pm: float, *, free: bool = False
) -> list[list[Stroke]]:
    """For every segment, in the template's order, the ways to paint it that can be driven, the given direction first.

    With `free`, a full circle may begin anywhere (at one of `CIRCLE_STARTS` points).

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
    return [_modes(segment, vehicle.nozzle_y_m, curvature_max_1pm, free) for segment in segments]


def strokes(segments: tuple[TemplateSegment, ...], vehicle: Vehicle, curvature_max_1pm: float) -> list[Stroke]:
    """Every segment in the template's order, turned round where only the other direction can be driven.

    Raises:
        PlanningError: As `modes`.
    """
    return [ways[0] for ways in modes(segments, vehicle, curvature_max_1pm)]


def _modes(segment: TemplateSegment, nozzle_left_m: float, curvature_max_1pm: float, free: bool) -> list[Stroke]:
    given = segment.curve()
    curves = _begun_elsewhere(given) if free else [given]
    found = []
    for nozzle, flipped in ((turned(curve), flipped) for flipped, turned in _BOTH_WAYS for curve in curves):
        robot = _drivable(nozzle, nozzle_left_m, curvature_max_1pm)
        if robot is not None:
            found.append(Stroke(segment.id, segment.label, segment.actuation, nozzle, robot, flipped))
    if found:
        return found
    smallest = max(1.0 / curvature_max_1pm - abs(nozzle_left_m), 0.0)
    raise PlanningError(
        segment.id,
        f"has a radius of {1.0 / abs(given.curvature_1pm):.3f} m, too tight for the robot in either direction",
        f"use a radius of at least {smallest:.3f} m, or a kappa_max above {curvature_max_1pm:g} 1/m",
    )


def _begun_elsewhere(curve: Curve) -> list[Curve]:
    """A full circle begun at several points, any other curve as it is."""
    if abs(abs(curve.curvature_1pm) * curve.length_m - math.tau) > FULL_TURN_RAD:
        return [curve]
    stations = curve.length_m * np.arange(CIRCLE_STARTS) / CIRCLE_STARTS
    return [
        replace(curve, x_m=float(x), y_m=float(y), heading_rad=wrap_angle(float(heading)))
        for x, y, heading, _ in zip(*curve.at(stations), strict=True)
    ]


def _drivable(nozzle: Curve, nozzle_left_m: float, curvature_max_1pm: float) -> Curve | None:
    """The robot's curve while its nozzle, `nozzle_left_m` to its left, follows `nozzle`; None if it is too tight."""
    if nozzle.curvature_1pm * -nozzle_left_m >= 1.0:
        return None
    robot = nozzle.offset(-nozzle_left_m)
    return robot if abs(robot.curvature_1pm) <= curvature_max_1pm * (1.0 + CURVATURE_SLACK) else None
