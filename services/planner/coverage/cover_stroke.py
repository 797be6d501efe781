"""Strokes of a coverage route: straights along which the tool works."""

import math
from dataclasses import dataclass

from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath


@dataclass(frozen=True)
class CoverStroke:
    """A straight along which the tool works, as long as the machine has room on it.

    Attributes:
        kind: Its purpose.
        label: Name for people.
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
        """Pose at a distance from its beginning."""
        return self.start.moved(complex(self.direction * s_m, 0.0), 0.0)

    def part(self, first_m: float, last_m: float) -> PiecePath:
        """Path along a part of it, backward if `last_m` is less than `first_m`."""
        direction = self.direction if last_m >= first_m else -self.direction
        return PiecePath(self.at(first_m), (Piece(abs(last_m - first_m), direction=direction),))

    @property
    def turned(self) -> "CoverStroke":
        """The same straight in the opposite direction, the machine turned round."""
        end = self.at(self.length_m)
        about = end._replace(heading_rad=end.heading_rad + math.pi)
        return CoverStroke(self.kind, self.label, about, self.length_m, self.direction)
