"""Compiled: moves of blocks of a tour.

A tour is an array of nodes; a node is a segment in one of its modes. `flip[a]` is the node that paints the segment of
node a in the opposite direction.
"""

from typing import NamedTuple

import numpy as np

from touchline.core.arrays import copy
from touchline.core.jit import borrowing
from touchline.services.planner.geometry.clothoid import Ints


class Board(NamedTuple):
    """A tour that is changed in place.

    Attributes:
        tour: (n,) nodes, the depot first.
        flip: (nodes,) each node's opposite.
        scratch: (n,) working space for a block that is moved.
    """

    tour: Ints
    flip: Ints
    scratch: Ints


def board_of(tour: Ints, flip: Ints) -> Board:
    """Create the board for a tour (n,) that is changed in place."""
    return Board(tour, flip, np.empty(len(tour), dtype=np.int64))


@borrowing
def swap(board: Board, i: int, j: int, e: int, flips: bool) -> None:
    """Move the block j…e before the block i…j−1, flipped or not.

    Args:
        board: Board of the tour, changed in place.
        i: First position of the first block.
        j: First position of the second block.
        e: Last position of the second block.
        flips: Whether the block j…e is flipped.
    """
    tour, flip, scratch = board.tour, board.flip, board.scratch
    moved = e - j + 1
    for k in range(moved):
        scratch[k] = flip[tour[e - k]] if flips else tour[j + k]
    for k in range(j - 1, i - 1, -1):
        tour[k + moved] = tour[k]
    copy(scratch[:moved], tour[i:])


@borrowing
def put_behind(board: Board, i: int, j: int, e: int, flips: bool) -> None:
    """Move the block i…j−1 after the block j…e, flipped or not.

    Args:
        board: Board of the tour, changed in place.
        i: First position of the first block.
        j: First position of the second block.
        e: Last position of the second block.
        flips: Whether the block i…j−1 is flipped.
    """
    tour, flip, scratch = board.tour, board.flip, board.scratch
    moved = j - i
    for k in range(moved):
        scratch[k] = flip[tour[j - 1 - k]] if flips else tour[i + k]
    for k in range(j, e + 1):
        tour[k - moved] = tour[k]
    copy(scratch[:moved], tour[e - moved + 1 :])


@borrowing
def reverse(board: Board, i: int, j: int) -> None:
    """Reverse the block i…j."""
    tour, flip = board.tour, board.flip
    while i < j:
        tour[i], tour[j] = flip[tour[j]], flip[tour[i]]
        i += 1
        j -= 1
    if i == j:
        tour[i] = flip[tour[i]]
