"""Lines and arcs by arc length: position, heading and curvature.

A line is an arc of curvature 0, so both share one formula: along a curve of curvature κ from (x₀, y₀, θ₀) the chord of
arc length s has length s·sinc(κs/2) and heading θ₀ + κs/2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from touchline.schemas.messages.standard import Point
from touchline.schemas.messages.turf_tank import Arc, CurveMessage, CurveType, Line

Floats = npt.NDArray[np.float64]

#: No place on a field, length of a path or curvature of a drivable arc is as large (m, 1/m).
_LARGEST = 1e9
#: An arc of a smaller radius is a turn on the spot (m).
_SPIN_RADIUS_M = 1e-6


def wrap_angle(angle_rad: float) -> float:
    """``angle_rad`` in (−π, π]."""
    return float(np.pi - (np.pi - angle_rad) % (2 * np.pi))


def along(
    x_m: npt.ArrayLike, y_m: npt.ArrayLike, heading_rad: npt.ArrayLike, curvature_1pm: npt.ArrayLike, s_m: npt.ArrayLike
) -> tuple[Floats, Floats, Floats, Floats]:
    """Pose and curvature ``s_m`` along curves of constant curvature; all arguments broadcast."""
    s, kappa, heading = np.asarray(s_m, float), np.asarray(curvature_1pm, float), np.asarray(heading_rad, float)
    half_turn = kappa * s / 2
    chord = s * np.sinc(half_turn / np.pi)
    x = x_m + chord * np.cos(heading + half_turn)
    y = y_m + chord * np.sin(heading + half_turn)
    return x, y, heading + 2 * half_turn, np.broadcast_to(kappa, x.shape)


@dataclass(frozen=True)
class Curve:
    """A line or an arc in the map frame.

    Attributes:
        x_m, y_m: Start.
        heading_rad: Tangent at the start.
        curvature_1pm: Left positive; 0 for a line.
        length_m: Arc length, positive.
    """

    x_m: float
    y_m: float
    heading_rad: float
    curvature_1pm: float
    length_m: float

    @classmethod
    def from_line(cls, start: tuple[float, float], end: tuple[float, float]) -> Self:
        """The line from ``start`` to ``end`` (m)."""
        dx, dy = end[0] - start[0], end[1] - start[1]
        return cls(start[0], start[1], float(np.arctan2(dy, dx)), 0.0, float(np.hypot(dx, dy)))

    @classmethod
    def from_arc(cls, start: tuple[float, float], center: tuple[float, float], sweep_rad: float) -> Self:
        """The arc about ``center`` from ``start`` (m), counter-clockwise for a positive ``sweep_rad``.

        Raises:
            ValueError: The arc has no radius.
        """
        dx, dy = start[0] - center[0], start[1] - center[1]
        radius = float(np.hypot(dx, dy))
        if radius == 0.0:
            raise ValueError("an arc that starts at its center has no radius")
        turn = float(np.copysign(1.0, sweep_rad))
        heading = wrap_angle(float(np.arctan2(dy, dx)) + turn * np.pi / 2)
        return cls(start[0], start[1], heading, turn / radius, radius * abs(sweep_rad))

    @classmethod
    def from_message(cls, message: CurveMessage) -> Self:
        """The curve of a ``tt_geometry_msgs/Curve``.

        Raises:
            ValueError: The type is neither LINE nor ARC, its alternative is missing, the arc has no radius, or a
                number is not finite or too large to be a place on a field.
        """
        with np.errstate(over="ignore"):  # what is too large is told below
            curve = cls._of_message(message)
        if not all(abs(value) < _LARGEST for value in (curve.x_m, curve.y_m, curve.curvature_1pm, curve.length_m)):
            raise ValueError("a curve must have finite numbers, and lie on a field")
        return curve

    @classmethod
    def _of_message(cls, message: CurveMessage) -> Self:
        if message.type.value == CurveType.LINE and message.line:
            line = message.line[0]
            return cls.from_line((line.start.x, line.start.y), (line.end.x, line.end.y))
        if message.type.value == CurveType.ARC and message.arc:
            arc = message.arc[0]
            return cls.from_arc((arc.start.x, arc.start.y), (arc.center.x, arc.center.y), arc.sweep_angle)
        raise ValueError("a curve must be a LINE or an ARC and hold it")

    def to_message(self) -> CurveMessage:
        """This curve as ``tt_geometry_msgs/Curve``."""
        start = Point(x=self.x_m, y=self.y_m)
        if self.curvature_1pm == 0.0:
            end_x, end_y, _, _ = self.at(self.length_m)
            line = Line(start=start, end=Point(x=float(end_x), y=float(end_y)))
            return CurveMessage(type=CurveType(value=CurveType.LINE), line=(line,))
        center = Point(
            x=self.x_m - np.sin(self.heading_rad) / self.curvature_1pm,
            y=self.y_m + np.cos(self.heading_rad) / self.curvature_1pm,
        )
        arc = Arc(start=start, center=center, sweep_angle=self.curvature_1pm * self.length_m)
        return CurveMessage(type=CurveType(value=CurveType.ARC), arc=(arc,))

    def at(self, s_m: npt.ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """(x m, y m, heading rad, curvature 1/m) at arc length ``s_m``, each of the shape of ``s_m``."""
        return along(self.x_m, self.y_m, self.heading_rad, self.curvature_1pm, s_m)

    @property
    def end(self) -> tuple[float, float, float]:
        """(x m, y m, heading rad) at the end."""
        x, y, heading, _ = self.at(self.length_m)
        return float(x), float(y), float(heading)

    def reversed(self) -> Self:
        """The same points, travelled the other way."""
        x, y, heading = self.end
        return type(self)(x, y, wrap_angle(heading + np.pi), -self.curvature_1pm, self.length_m)

    def offset(self, left_m: float) -> Self:
        """The parallel curve at ``left_m`` to the left (negative: right), travelled the same way.

        Raises:
            ValueError: The parallel curve of an arc would have no radius left.
        """
        scale = 1.0 - self.curvature_1pm * left_m
        if scale <= 0.0:
            raise ValueError(
                f"an arc of radius {abs(1 / self.curvature_1pm):.3f} m has no parallel {left_m:.3f} m inside"
            )
        return type(self)(
            self.x_m - left_m * float(np.sin(self.heading_rad)),
            self.y_m + left_m * float(np.cos(self.heading_rad)),
            self.heading_rad,
            self.curvature_1pm / scale,
            self.length_m * scale,
        )


def spin_rad(message: CurveMessage) -> float | None:
    """Angle of a turn on the spot, counter-clockwise positive; None for any other curve.

    A turn on the spot is an ARC that starts at its center: it has no length and no tangent, so it is no `Curve`.
    """
    if message.type.value != CurveType.ARC or not message.arc:
        return None
    arc = message.arc[0]
    at_center = float(np.hypot(arc.start.x - arc.center.x, arc.start.y - arc.center.y)) < _SPIN_RADIUS_M
    return arc.sweep_angle if at_center else None


@dataclass(frozen=True)
class PathTable:
    """A sequence of curves as columns of numbers.

    Attributes:
        array: (n, 7) float64: x m, y m, heading rad, curvature 1/m, length m, arc length at the start m, direction
            (+1 forward, −1 backward); the form that kernels take.
    """

    array: Floats

    @classmethod
    def from_curves(cls, curves: Sequence[Curve]) -> Self:
        """A table of ``curves``, driven forward."""
        rows = np.array([(c.x_m, c.y_m, c.heading_rad, c.curvature_1pm, c.length_m) for c in curves], dtype=np.float64)
        rows = rows.reshape(-1, 5)
        starts = np.concatenate(([0.0], np.cumsum(rows[:, 4])))[:-1] if len(rows) else np.zeros(0)
        return cls(np.column_stack((rows, starts, np.ones(len(rows)))))

    @property
    def starts_m(self) -> Floats:
        """(n,) arc length at which each curve begins."""
        return self.array[:, 5]

    @property
    def total_length_m(self) -> float:
        """Arc length of the whole path."""
        return float(self.array[-1, 4] + self.array[-1, 5]) if len(self.array) else 0.0

    def index_at(self, s_m: npt.ArrayLike) -> npt.NDArray[np.intp]:
        """Index of the curve at arc length ``s_m``, clamped to the path."""
        found = np.searchsorted(self.starts_m, np.asarray(s_m, float), side="right") - 1
        return np.clip(found, 0, len(self.array) - 1)

    def at(self, s_m: npt.ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """(x, y, heading, curvature) at arc length ``s_m``; beyond an end the first or last curve goes on."""
        rows = self.array[self.index_at(s_m)]
        local = np.asarray(s_m, float) - rows[..., 5]
        return along(rows[..., 0], rows[..., 1], rows[..., 2], rows[..., 3], local)
