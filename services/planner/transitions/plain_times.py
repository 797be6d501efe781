"""Compiled: padded plain Dubins paths from painted segment to painted segment, and their times."""

import numpy as np

from touchline.services.core.jit import kernel
from touchline.services.planner.drives.caps import Caps
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.speed.topp import path_time
from touchline.services.planner.steering.construct import put
from touchline.services.planner.steering.plain_words import put_plain_word

# Columns of an end's row: the pose at the paddings' other end (m, m, rad), and the speed (m/s) on the painted curve.
SPEED = 3
# A way has no more pieces: three of a word, and the paddings.
PLAIN_PIECES = 5


@kernel
def plain_times(
    starts: Floats,
    goals: Floats,
    curvature: float,
    paddings: tuple[float, float],
    limits: Caps,
    pairs: Ints,
    tracks: Floats,
    counts: Ints,
) -> Floats:
    """Seconds (n,) of the way of every pair (n, 2) of start and goal; fills its pieces and their number.

    `starts` and `goals` are (ends, 4), `curvature` (1/m) is that of turns, `paddings` (m) are those after and before a
    segment; `tracks` (n, PLAIN_PIECES, 5) and `counts` (n,).
    """
    seconds = np.empty(len(pairs))
    for p in range(len(pairs)):
        start, goal, pieces = starts[pairs[p, 0]], goals[pairs[p, 1]], tracks[p]
        count = put(pieces, 0, paddings[0], 0.0, 0.0, 1.0)
        count = put_plain_word(start, goal, curvature, pieces, count)
        count = put(pieces, count, paddings[1], 0.0, 0.0, 1.0)
        counts[p] = count
        seconds[p] = path_time(pieces, count, start[SPEED], goal[SPEED], limits)
    return seconds
