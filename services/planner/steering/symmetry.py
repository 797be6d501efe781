"""Reversed queries: driven from the goal to the start, facing the other way, a path keeps its length.

A robot at the goal, facing backward, that drives to the start and faces backward there, passes the same points in the
opposite order; forward stays forward, left turns become right turns. So the search for paths begins from both ends.
(The other symmetry, the mirror image, needs nothing: every step of the search respects it.)
"""

import numpy as np

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.query import Query


@kernel
def reversed_query(query: Query) -> Query:
    """Return the query from the goal back to the start."""
    ends = np.empty(2)
    ends[0], ends[1] = -query.ends[1], -query.ends[0]
    return Query(ends, query.goal * unit(-query.turn), -query.turn, query.circle)


@kernel
def reverse_pieces(pieces: Floats, n: int) -> None:
    """Reverse a path: pieces in the opposite order, curvatures of the other sign, directions kept.

    Args:
        pieces: (many, 4 or 5) length, curvature, sharpness and direction, changed in place.
        n: Number of pieces.
    """
    for i in range(n):
        pieces[i, 1] = -(pieces[i, 1] + pieces[i, 2] * pieces[i, 0])
    for i in range(n // 2):
        for column in range(4):
            other = pieces[n - 1 - i, column]
            pieces[n - 1 - i, column] = pieces[i, column]
            pieces[i, column] = other
