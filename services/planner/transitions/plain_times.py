"""Compiled: padded plain Dubins paths between painted segments, and their times."""

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.drives.caps import Caps
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.speed.topp import path_time
from touchline.services.planner.steering.construct import put
from touchline.services.planner.steering.plain_words import put_plain_word
from touchline.services.planner.transitions.piece_table import PieceTable

# Columns of an end's row: the pose at the far end of the padding (m, m, rad), and the speed (m/s) on the painted curve.
SPEED = 3
# Maximum number of pieces: three of a word, and the paddings.
PLAIN_PIECES = 5


@kernel
def plain_times(
    rows: tuple[Floats, Floats],
    curvature: float,
    paddings: tuple[float, float],
    limits: Caps,
    pairs: Ints,
    found: PieceTable,
) -> Floats:
    """Compute seconds (n,) of the transition of every pair (n, 2) of start and goal, and its pieces.

    Args:
        rows: Rows (ends, 4) and (beginnings, 4).
        curvature: Curvature of turns (1/m).
        paddings: Lengths of the straights after a segment and before one (m).
        limits: Limits of drive and plan.
        pairs: (n, 2) numbers of an end and a beginning.
        found: Table of n transitions of up to PLAIN_PIECES, filled in.
    """
    seconds = np.empty(len(pairs))
    for p in range(len(pairs)):
        start, goal, pieces = rows[0][pairs[p, 0]], rows[1][pairs[p, 1]], found.pieces[p]
        count = put(pieces, 0, paddings[0], 0.0, 0.0, 1.0)
        count = put_plain_word(start, goal, curvature, pieces, count)
        count = put(pieces, count, paddings[1], 0.0, 0.0, 1.0)
        found.counts[p] = count
        seconds[p] = path_time(pieces, count, start[SPEED], goal[SPEED], limits)
    return seconds
