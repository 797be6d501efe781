"""Paths of the axle's middle along which the nozzle paints the template's segments."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from touchline.schemas.curves import Curve, wrap_angle
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.steering.method import CurveEnd

# Rounding may put an arc at exactly the maximum curvature a little above it.
CURVATURE_SLACK = 1e-9
# An arc this close to a full turn is a circle, and may begin at any of this many points.
FULL_TURN_RAD = 1e-6
CIRCLE_STARTS = 8
_BOTH_DIRECTIONS: tuple[tuple[bool, Callable[[Curve], Curve]], ...] = (
    (False, lambda c: c),
    (True, lambda c: c.reversed()),
)


@dataclass(frozen=True)
class Stroke:
    """Template segment as painted: curves of nozzle and robot, in the direction of travel."""

    id: str
    label: str
    actuation: str
    nozzle: Curve
    robot: Curve
    flipped: bool

    @property
    def begin(self) -> CurveEnd:
        """Robot pose and curvature at the beginning of painting."""
        return CurveEnd(PathPose(self.robot.x_m, self.robot.y_m, self.robot.heading_rad), self.robot.curvature_1pm)

    @property
    def end(self) -> CurveEnd:
        """Robot pose and curvature at the end of painting."""
        return CurveEnd(PathPose(*self.robot.end), self.robot.curvature_1pm)

    @property
    def path(self) -> PiecePath:
        """Curve of the robot as a path of one piece."""
        return PiecePath(self.begin.pose, (Piece(self.robot.length_m, self.robot.curvature_1pm),))


def modes(
    segments: tuple[TemplateSegment, ...], vehicle: Vehicle, curvature_max_1pm: float, *, free: bool = False
) -> list[list[Stroke]]:
    """List the drivable modes of every segment, in the template's order, the given direction first.

    Args:
        segments: Segments of the template.
        vehicle: Vehicle that paints.
        curvature_max_1pm: Maximum curvature of the robot's path.
        free: Whether a full circle may begin at any of `CIRCLE_STARTS` points.

    Raises:
        PlanningError: Two segments share an id, or an arc cannot be driven at all.
    """
    seen: set[str] = set()
    for segment in segments:
        if segment.id in seen:
            raise PlanningError(segment.id, "appears twice", "give every segment an id of its own")
        seen.add(segment.id)
    at_m = vehicle.tool.point_m
    return [_modes(segment, at_m, curvature_max_1pm, free) for segment in segments]


def strokes(segments: tuple[TemplateSegment, ...], vehicle: Vehicle, curvature_max_1pm: float) -> list[Stroke]:
    """Convert segments to strokes in the template's order, reversed where only the opposite direction can be driven.

    Raises:
        PlanningError: See `modes`.
    """
    return [choice[0] for choice in modes(segments, vehicle, curvature_max_1pm)]


def _modes(segment: TemplateSegment, at_m: tuple[float, float], curvature_max_1pm: float, free: bool) -> list[Stroke]:
    given = segment.curve()
    curves = _begun_elsewhere(given) if free else [given]
    found = []
    for nozzle, flipped in ((turned(curve), flipped) for flipped, turned in _BOTH_DIRECTIONS for curve in curves):
        robot = _drivable(nozzle, at_m, curvature_max_1pm)
        if robot is not None:
            found.append(Stroke(segment.id, segment.label, segment.actuation, nozzle, robot, flipped))
    if found:
        return found
    smallest = math.hypot(at_m[0], max(1.0 / curvature_max_1pm - abs(at_m[1]), 0.0))
    raise PlanningError(
        segment.id,
        f"has a radius of {1.0 / abs(given.curvature_1pm):.3f} m, too tight for the robot in either direction",
        f"use a radius of at least {smallest:.3f} m, or a kappa_max above {curvature_max_1pm:g} 1/m",
    )


def _begun_elsewhere(curve: Curve) -> list[Curve]:
    """Copies of a full circle that begin at several points; any other curve is returned unchanged."""
    if abs(abs(curve.curvature_1pm) * curve.length_m - math.tau) > FULL_TURN_RAD:
        return [curve]
    stations = curve.length_m * np.arange(CIRCLE_STARTS) / CIRCLE_STARTS
    return [
        replace(curve, x_m=float(x), y_m=float(y), heading_rad=wrap_angle(float(heading)))
        for x, y, heading, _ in zip(*curve.at(stations), strict=True)
    ]


def _drivable(nozzle: Curve, at_m: tuple[float, float], curvature_max_1pm: float) -> Curve | None:
    """Curve of the robot while its nozzle, at (ahead, left), follows `nozzle`; None if it is too tight."""
    robot = _axle_curve(nozzle, *at_m)
    if robot is None or abs(robot.curvature_1pm) > curvature_max_1pm * (1.0 + CURVATURE_SLACK):
        return None
    return robot


def _axle_curve(nozzle: Curve, ahead_m: float, left_m: float) -> Curve | None:
    """Curve of the axle's middle whose nozzle, at (`ahead_m`, `left_m`), follows `nozzle`; None if there is none.

    On an arc both circle about a point on the axle's line, at (0, ρ) in the robot's frame: for a nozzle radius R,
    R² = ahead² + (ρ − left)², and the nozzle heads asin(ahead / R) further to the left than the robot.
    """
    if nozzle.curvature_1pm * -left_m >= 1.0:
        return None
    if ahead_m == 0.0:
        return nozzle.offset(-left_m)
    heading, radius_m, length_m = nozzle.heading_rad, math.inf, nozzle.length_m
    if nozzle.curvature_1pm != 0.0:
        across = ahead_m * nozzle.curvature_1pm
        if abs(across) >= 1.0:
            return None
        heading -= math.asin(across)
        radius_m = left_m + math.sqrt(1.0 - across * across) / nozzle.curvature_1pm
        if radius_m * nozzle.curvature_1pm <= 0.0:
            return None
        length_m *= radius_m * nozzle.curvature_1pm
    cos, sin = math.cos(heading), math.sin(heading)
    x_m, y_m = nozzle.x_m - (cos * ahead_m - sin * left_m), nozzle.y_m - (sin * ahead_m + cos * left_m)
    return Curve(x_m, y_m, wrap_angle(heading), 1.0 / radius_m, length_m)
