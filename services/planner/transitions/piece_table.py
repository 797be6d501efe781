"""Table of the pieces of many transitions, filled in by kernels."""

from typing import NamedTuple

from touchline.services.planner.geometry.clothoid import Floats, Ints


class PieceTable(NamedTuple):
    """Pieces of n transitions.

    Attributes:
        pieces: (n, k, 5) columns of `Piece`, from the end of the painted segment on.
        counts: (n,) numbers of pieces.
    """

    pieces: Floats
    counts: Ints
