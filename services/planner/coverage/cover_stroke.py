"""Straight stretches that are driven to be worked."""

import math
from dataclasses import dataclass

from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath


@dataclass(frozen=True)
class CoverStroke:
    """A straight to be worked, as far as the machine may stand on it.

    Attributes:
        kind: What it is there for.
        label: In words.
        start: Pose at its beginning.
        length_m: Its length.
        direction: 1 forward, −1 backward.
    """

    kind: DriveKind
    label: str
    start: PathPose
    length_m: float
    direction: int = 1

    def at(self, s_m: float) -> PathPose:
        """The pose so far along it."""
        return self.start.moved(complex(self.direction * s_m, 0.0), 0.0)

    def part(self, first_m: float, last_m: float) -> PiecePath:
        """The path along a part of it; against its direction where `last_m` is less."""
        direction = self.direction if last_m >= first_m else -self.direction
        return PiecePath(self.at(first_m), (Piece(abs(last_m - first_m), direction=direction),))

    @property
    def turned(self) -> "CoverStroke":
        """The same the other way, the machine turned round."""
        end = self.at(self.length_m)
        about = end._replace(heading_rad=end.heading_rad + math.pi)
        return CoverStroke(self.kind, self.label, about, self.length_m, self.direction)
