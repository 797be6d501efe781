"""Elementary pieces of a path: line, arc and clothoid are one formula, curvature linear in arc length.

Units: metres, radians, 1/m (curvature) and 1/m² (sharpness). Planar points are complex numbers x + iy.

Frames (REP-103): θ is the heading of the robot, which a reversing robot keeps pointing backward along its path. Arc
length s ≥ 0 is the distance travelled in either direction. With the direction d = +1 forward, −1 backward:

    dp/ds = d·exp(iθ),   dθ/ds = d·κ,   dκ/ds = σ

So κ = ω/v is what the robot steers: positive where the turning centre is to the robot's left, forward or backward, and
the same number on both sides of a cusp where the robot returns on its own track. σ is the change of κ per metre
travelled. A turn on the spot has no length: it adds an angle to θ.
"""

import cmath
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Sixteen Gauss-Legendre nodes integrate exp(iθ(s)) to rounding error where θ changes by less than this over the panel.
_ABSCISSAE, _WEIGHTS = np.polynomial.legendre.leggauss(16)
NODES: Floats = (_ABSCISSAE + 1.0) / 2.0
WEIGHTS: Floats = _WEIGHTS / 2.0
UNIT_PANEL: tuple[tuple[float, float], ...] = tuple(zip(NODES.tolist(), WEIGHTS.tolist(), strict=True))
PANEL_TURN_RAD = 4.0


class PathPose(NamedTuple):
    """Position (m) and heading (rad, counter-clockwise from +x) in the map frame."""

    x_m: float
    y_m: float
    heading_rad: float

    @property
    def point(self) -> complex:
        """Position as x + iy (m)."""
        return complex(self.x_m, self.y_m)

    @property
    def direction(self) -> complex:
        """Unit vector of the heading."""
        return cmath.rect(1.0, self.heading_rad)

    def moved(self, displacement: complex, turn_rad: float) -> "PathPose":
        """Pose after `displacement` (m, in the frame of this pose) and a turn of `turn_rad`."""
        point = self.point + self.direction * displacement
        return PathPose(point.real, point.imag, self.heading_rad + turn_rad)

    def seen_from(self, other: "PathPose") -> tuple[complex, float]:
        """Position (m) and heading (rad) of this pose in the frame of `other`."""
        return (self.point - other.point) / other.direction, self.heading_rad - other.heading_rad


class Piece(NamedTuple):
    """A stretch of path whose curvature is `curvature_1pm + sharpness_1pm2 · s`, or a turn on the spot.

    `direction` is +1 (forward) or −1 (backward). Only a piece without length turns on the spot, by `spin_rad`.
    """

    length_m: float
    curvature_1pm: float = 0.0
    sharpness_1pm2: float = 0.0
    direction: int = 1
    spin_rad: float = 0.0

    @classmethod
    def spin(cls, angle_rad: float) -> "Piece":
        """Turn on the spot by `angle_rad`."""
        return cls(0.0, spin_rad=angle_rad)

    @property
    def curvature_end_1pm(self) -> float:
        """Curvature (1/m) at the end of the piece."""
        return self.curvature_at(self.length_m)

    def curvature_at(self, s_m: float) -> float:
        """Curvature (1/m) at arc length `s_m` from the start of the piece."""
        return self.curvature_1pm + self.sharpness_1pm2 * s_m

    def turn_at(self, s_m: float) -> float:
        """Change of heading (rad) from before the piece to arc length `s_m`; a turn on the spot comes first."""
        return self.spin_rad + self.direction * (self.curvature_1pm + 0.5 * self.sharpness_1pm2 * s_m) * s_m

    def displacement_at(self, s_m: float) -> complex:
        """Displacement (m, in the frame of the start pose) from the start to arc length `s_m`."""
        # Driving backward by s with (κ, σ) is the formula of driving forward by −s with (κ, −σ).
        s_m, curvature, sharpness = self.direction * s_m, self.curvature_1pm, self.direction * self.sharpness_1pm2
        if sharpness == 0.0:
            return arc_displacement(s_m, curvature)
        turn = (abs(curvature) + 0.5 * abs(sharpness * s_m)) * abs(s_m)
        panels = 1 + int(turn / PANEL_TURN_RAD)
        h = s_m / panels
        total = 0j
        for panel in range(panels):
            for node, weight in UNIT_PANEL:
                s = (panel + node) * h
                total += weight * cmath.rect(h, (curvature + 0.5 * sharpness * s) * s)
        return total

    def mirrored(self) -> "Piece":
        """Mirror image of the piece, which turns to the other side."""
        return Piece(self.length_m, -self.curvature_1pm, -self.sharpness_1pm2, self.direction, -self.spin_rad)


def arc_displacement(length_m: float, curvature_1pm: float) -> complex:
    """Displacement (m) along an arc or a line, in the frame of its start: the chord, at half the turn."""
    half_turn = 0.5 * curvature_1pm * length_m
    sinc = math.sin(half_turn) / half_turn if half_turn else 1.0
    return cmath.rect(1.0, half_turn) * (length_m * sinc)


def joined(pieces: Iterable[Piece]) -> tuple[Piece, ...]:
    """Drop empty pieces, and merge neighbouring lines or arcs of the same curvature and direction."""
    result: list[Piece] = []
    for piece in pieces:
        if piece.length_m <= 0.0 and not piece.spin_rad:
            continue
        last = result[-1] if result else None
        if last and not last.spin_rad and last[1:] == piece[1:] and not piece.sharpness_1pm2:
            result[-1] = last._replace(length_m=last.length_m + piece.length_m)
        else:
            result.append(piece)
    return tuple(result)


@dataclass(frozen=True)
class PiecePath:
    """A start pose and the pieces that follow it: the ideal curve, before it is divided into lines and arcs.

    Where the direction changes from piece to piece there is a cusp: the robot stops, and its curvature may step there,
    as it may at a turn on the spot. Everywhere else it is continuous.
    """

    start: PathPose
    pieces: tuple[Piece, ...]

    @cached_property
    def knots(self) -> tuple[PathPose, ...]:
        """Start pose, and pose after each piece."""
        poses = [self.start]
        for piece in self.pieces:
            poses.append(poses[-1].moved(piece.displacement_at(piece.length_m), piece.turn_at(piece.length_m)))
        return tuple(poses)

    @cached_property
    def stations(self) -> tuple[float, ...]:
        """Arc length (m) at each knot."""
        stations = [0.0]
        for piece in self.pieces:
            stations.append(stations[-1] + piece.length_m)
        return tuple(stations)

    @property
    def length_m(self) -> float:
        """Total arc length (m)."""
        return self.stations[-1]

    @property
    def moves(self) -> bool:
        """True if the robot moves, possibly only by a turn on the spot."""
        return any(piece.length_m > 0.0 or piece.spin_rad != 0.0 for piece in self.pieces)

    def spun(self, step_rad: float) -> Floats:
        """Poses (n, 3) x (m), y (m), heading (rad) during turns on the spot, at most a step apart."""
        found: list[Floats] = [np.empty((0, 3))]
        for piece, pose in zip(self.pieces, self.knots, strict=False):
            if piece.spin_rad:
                turned = np.linspace(0.0, piece.spin_rad, 2 + math.ceil(abs(piece.spin_rad) / step_rad))
                found.append(np.column_stack(np.broadcast_arrays(pose.x_m, pose.y_m, pose.heading_rad + turned)))
        return np.concatenate(found)

    @property
    def end(self) -> PathPose:
        """Pose after the last piece."""
        return self.knots[-1]

    def index_at(self, s_m: float) -> int:
        """Index of the piece that holds arc length `s_m`."""
        return max(0, min(int(np.searchsorted(self.stations, s_m, side="right")) - 1, len(self.pieces) - 1))

    def pose_at(self, s_m: float) -> PathPose:
        """Pose at arc length `s_m`; after the turn on the spot, if there is one at `s_m`."""
        if not self.pieces:
            return self.start
        i = self.index_at(s_m)
        piece, s = self.pieces[i], s_m - self.stations[i]
        return self.knots[i].moved(piece.displacement_at(s), piece.turn_at(s))

    def sample(self, s_m: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Sampled x (m), y (m), heading (rad) and curvature (1/m), each (n,), at the arc lengths `s_m` (n,)."""
        if not self.pieces:
            still = np.zeros_like(s_m)
            return still + self.start.x_m, still + self.start.y_m, still + self.start.heading_rad, still
        index = np.clip(np.searchsorted(self.stations, s_m, side="right") - 1, 0, len(self.pieces) - 1)
        pieces, knots = np.asarray(self.pieces)[index], np.asarray(self.knots)[index]
        _, curvature, _, direction, spin = pieces.T
        # As in Piece.displacement_at: backward by s is forward by −s with the opposite sharpness.
        s, sharpness = direction * (s_m - np.asarray(self.stations)[index]), direction * pieces[:, 2]
        half_turn = 0.5 * curvature * s
        chord = s * np.sinc(half_turn / np.pi) * np.exp(1j * half_turn)
        bent = sharpness != 0.0
        chord[bent] = _clothoid_displacements(s[bent], curvature[bent], sharpness[bent])
        point = knots[:, 0] + 1j * knots[:, 1] + np.exp(1j * knots[:, 2]) * chord
        heading = knots[:, 2] + spin + (curvature + 0.5 * sharpness * s) * s
        return point.real, point.imag, heading, curvature + sharpness * s


def _clothoid_displacements(s: Floats, curvature: Floats, sharpness: Floats) -> NDArray[np.complex128]:
    if not s.size:
        return np.zeros(0, dtype=np.complex128)
    turn = np.max((np.abs(curvature) + 0.5 * np.abs(sharpness * s)) * np.abs(s))
    panels = 1 + int(turn / PANEL_TURN_RAD)
    nodes = ((np.arange(panels)[:, None] + NODES) / panels).ravel()
    at = s[:, None] * nodes
    turned = np.exp(1j * (curvature[:, None] + 0.5 * sharpness[:, None] * at) * at)
    displacement: NDArray[np.complex128] = s * (turned @ np.tile(WEIGHTS / panels, panels))
    return displacement
