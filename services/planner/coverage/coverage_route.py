"""Route of a coverage method, piece by piece."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby, pairwise

import shapely

from touchline.core.plain_sum import plain_sum
from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.geometry.clothoid import PiecePath


class DriveKind(StrEnum):
    """Purpose of a piece of a route."""

    SETTING_OUT = "setting out"
    LAP = "lap"
    LANE = "lane"
    TURN = "turn"
    TOUCH_UP = "touch-up"


@dataclass(frozen=True)
class DrivePiece:
    """A stretch that is driven in one direction, with turns on the spot but no cusp inside.

    Attributes:
        kind: Its purpose.
        label: Name for people, such as "lane 7".
        path: Continuous in curvature; all its pieces have one direction.
        worked: Whether it is driven for the work; the tool works on transitions, too.
    """

    kind: DriveKind
    label: str
    path: PiecePath
    worked: bool

    @property
    def direction(self) -> int:
        """1 forward, −1 backward."""
        return self.path.pieces[0].direction


@dataclass(frozen=True)
class CoverageRoute:
    """A route over an area.

    Attributes:
        pieces: In driving order; each begins at the pose at which the previous one ends.
        reachable: Part of the area that the tool can reach (m, map frame).
        remarks: Sentences about what the method could not do.
    """

    pieces: tuple[DrivePiece, ...]
    reachable: shapely.Polygon | shapely.MultiPolygon
    remarks: tuple[str, ...] = ()

    @property
    def length_m(self) -> float:
        """Length of the whole route (m)."""
        return plain_sum(piece.path.length_m for piece in self.pieces)

    @property
    def cusps(self) -> int:
        """Number of changes of the direction of travel."""
        return sum(a.direction != b.direction for a, b in pairwise(self.pieces))

    def seconds(self, machine: CoverageMachine) -> float:
        """Seconds from rest to rest, if only cusps, bends and turns on the spot slow the machine down."""
        return machine.seconds(part for piece in self.pieces for part in piece.path.pieces)


def split_at_cusps(kind: DriveKind, label: str, path: PiecePath, *, worked: bool) -> Iterator[DrivePiece]:
    """Split a path where its direction of travel changes."""
    at = path.start
    for _, group in groupby(path.pieces, key=lambda piece: piece.direction):
        part = PiecePath(at, tuple(group))
        yield DrivePiece(kind, label, part, worked)
        at = part.end
