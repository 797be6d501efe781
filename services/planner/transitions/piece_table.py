"""Pieces of many transitions at once, as kernels fill them in."""

from typing import NamedTuple

from touchline.services.planner.geometry.clothoid import Floats, Ints


class PieceTable(NamedTuple):
    """The pieces of n transitions.

    Attributes:
        pieces: (n, k, 5) the columns of `Piece`, from the end of the painted segment on.
        counts: (n,) how many of them there are.
    """

    pieces: Floats
    counts: Ints
