"""Turns between two straight headings: the plain arc and the curvature-continuous (CC) turn.

Both are described by their turning centre, so that one geometry of words (words.py) serves both.
Source: Fraichard and Scheuer, "From Reeds and Shepp's to continuous-curvature paths", IEEE T-RO 20(6), 2004.
"""

import math
from typing import Protocol

from touchline.core.plain_sum import plain_sum
from touchline.services.planner.geometry.clothoid import UNIT_PANEL, Piece

# Above this deflection at the tightest clothoid pair a CC turn is no longer regular (the pair winds round itself).
REGULAR_DEFLECTION_RAD = math.pi


class Turn(Protocol):
    """A left turn from zero curvature to zero curvature by any deflection in [0, 2π); the right turn is its mirror."""

    @property
    def centre(self) -> complex:
        """Turning centre (m) relative to the pose at which the turn begins."""

    def length(self, deflection_rad: float) -> float:
        """Arc length (m) of the turn by `deflection_rad` in [0, 2π)."""

    def pieces(self, deflection_rad: float) -> tuple[Piece, ...]:
        """Pieces of the left turn by `deflection_rad` in [0, 2π)."""


class ArcTurn:
    """Turn of plain Dubins paths: one arc at the maximum curvature (1/m); curvature steps at both ends."""

    def __init__(self, curvature_max_1pm: float) -> None:
        self.curvature_max_1pm = curvature_max_1pm
        self.centre = complex(0.0, 1.0 / curvature_max_1pm)

    def length(self, deflection_rad: float) -> float:
        """Arc length of the turn (m)."""
        return deflection_rad / self.curvature_max_1pm

    def pieces(self, deflection_rad: float) -> tuple[Piece, ...]:
        """Pieces of the turn: an arc."""
        return (Piece(self.length(deflection_rad), self.curvature_max_1pm),)


class ContinuousTurn:
    """CC turn: clothoid, arc, clothoid; below the limit deflection θ_lim = κ²/σ a flatter pair of clothoids.

    All turns of any deflection start and end on one circle round `centre`, crossing it at one angle μ. A turn below
    θ_lim is the symmetric clothoid pair whose chord is the chord of that circle: its sharpness is at most σ_max and its
    peak curvature at most κ_max. A zero deflection is the straight chord. Where κ_max²/σ_max exceeds π the turn keeps
    to the smaller curvature √(πσ_max), which stays regular and inside both limits.
    """

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self.sharpness = sharpness_max_1pm2
        self.curvature = min(curvature_max_1pm, math.sqrt(REGULAR_DEFLECTION_RAD * sharpness_max_1pm2))
        self.spiral_length = self.curvature / self.sharpness
        self.limit_deflection = self.curvature * self.spiral_length
        spiral = Piece(self.spiral_length, 0.0, self.sharpness)
        heading = 0.5 * self.limit_deflection
        to_centre = complex(-math.sin(heading), math.cos(heading)) / self.curvature
        self.centre = spiral.displacement_at(self.spiral_length) + to_centre
        self.radius = abs(self.centre)
        self.crossing_angle = math.atan2(self.centre.real, self.centre.imag)

    def length(self, deflection_rad: float) -> float:
        """Arc length of the turn (m)."""
        if deflection_rad < self.limit_deflection:
            return 2.0 * self._partial_spiral_length(deflection_rad)
        return 2.0 * self.spiral_length + (deflection_rad - self.limit_deflection) / self.curvature

    def pieces(self, deflection_rad: float) -> tuple[Piece, ...]:
        """Pieces of the turn: clothoid, arc, clothoid, or two clothoids, or a line."""
        if deflection_rad == 0.0:
            return (Piece(2.0 * self._partial_spiral_length(0.0)),)
        if deflection_rad < self.limit_deflection:
            length = self._partial_spiral_length(deflection_rad)
            peak = deflection_rad / length
            return Piece(length, 0.0, peak / length), Piece(length, peak, -peak / length)
        arc_length = (deflection_rad - self.limit_deflection) / self.curvature
        return (
            Piece(self.spiral_length, 0.0, self.sharpness),
            Piece(arc_length, self.curvature),
            Piece(self.spiral_length, self.curvature, -self.sharpness),
        )

    def _partial_spiral_length(self, deflection_rad: float) -> float:
        # The chord of the pair, 2·l·∫₀¹ cos(δ(1 − t²)/2) dt, equals the chord 2·R·sin(δ/2 + μ) of the turning circle.
        half = 0.5 * deflection_rad
        unit_chord = plain_sum(weight * math.cos(half * (1.0 - t * t)) for t, weight in UNIT_PANEL)
        return self.radius * math.sin(half + self.crossing_angle) / unit_chord
