"""Queries turned round: driven from the goal to the start, looking the other way, a path keeps its length.

If the robot stands at the goal looking backward and drives to the start, looking backward there, it passes the same
points in the opposite order; what was driven forward still is, what turned left turns right. So the search for paths is
begun from both ends. (The other symmetry, the mirror image, needs nothing: every step of the search respects it.)
"""

import numpy as np

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.query import Query


@kernel
def turn_query_round(query: Query) -> Query:
    """The query from the goal back to the start."""
    ends = np.empty(2)
    ends[0], ends[1] = -query.ends[1], -query.ends[0]
    return Query(ends, query.goal * unit(-query.turn), -query.turn, query.circle)


@kernel
def turn_pieces_round(pieces: Floats, n: int) -> None:
    """Turn a path round: pieces in the opposite order, curvatures of the other sign, directions kept.

    Args:
        pieces: (many, 4 or 5) length, curvature, sharpness and direction, changed in place.
        n: How many of them there are.
    """
    for i in range(n):
        pieces[i, 1] = -(pieces[i, 1] + pieces[i, 2] * pieces[i, 0])
    for i in range(n // 2):
        for column in range(4):
            other = pieces[n - 1 - i, column]
            pieces[n - 1 - i, column] = pieces[i, column]
            pieces[i, column] = other
