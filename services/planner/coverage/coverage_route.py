"""The route of a coverage method: what is driven, piece by piece."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby, pairwise

import shapely

from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.geometry.clothoid import PiecePath


class DriveKind(StrEnum):
    """What a piece of the route is there for."""

    SETTING_OUT = "setting out"
    LAP = "lap"
    LANE = "lane"
    TURN = "turn"
    TOUCH_UP = "touch-up"


@dataclass(frozen=True)
class DrivePiece:
    """A stretch that is driven in one direction, with turns on the spot but no cusp inside.

    Attributes:
        kind: What it is there for.
        label: In words, such as "lane 7".
        path: Continuous in curvature; all its pieces have one direction.
        worked: Whether it is there to be worked; the tool works wherever it passes.
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
    """A way over an area.

    Attributes:
        pieces: In driving order; each begins at the pose at which the last one ended.
        reachable: What of the area the tool can reach at all (m, map frame).
        remarks: What the method could not do, in words.
    """

    pieces: tuple[DrivePiece, ...]
    reachable: shapely.Polygon | shapely.MultiPolygon
    remarks: tuple[str, ...] = ()

    @property
    def length_m(self) -> float:
        """Metres driven."""
        return sum(piece.path.length_m for piece in self.pieces)

    @property
    def cusps(self) -> int:
        """How often the direction of travel changes."""
        return sum(a.direction != b.direction for a, b in pairwise(self.pieces))

    def seconds(self, machine: CoverageMachine) -> float:
        """From standstill to standstill, if nothing slows the machine down but cusps, bends and turns on the spot."""
        return machine.seconds(part for piece in self.pieces for part in piece.path.pieces)


def one_way(kind: DriveKind, label: str, path: PiecePath, *, worked: bool) -> Iterator[DrivePiece]:
    """A path, parted where its direction of travel changes."""
    at = path.start
    for _, group in groupby(path.pieces, key=lambda piece: piece.direction):
        part = PiecePath(at, tuple(group))
        yield DrivePiece(kind, label, part, worked)
        at = part.end
