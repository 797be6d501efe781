"""Crossings of wet paint that no order of painting avoids."""

from collections.abc import Sequence

import numpy as np

from touchline.services.planner.geometry.clothoid import Ints
from touchline.services.planner.sequencing.wet_paint import Wheels, wet_rows
from touchline.services.planner.swaths.offset import Stroke


def unavoidable_crossings(
    strokes: Sequence[Stroke],
    over: Sequence[Ints],
    modes: Sequence[Sequence[Stroke]],
    wheels: Wheels,
) -> int:
    """Count the crossings that occur in any order and any modes of the two segments.

    Only waiting for the paint to dry would avoid them.

    Args:
        strokes: Strokes in driving order.
        over: For each stroke, number of crossings of each earlier stroke while it is painted.
        modes: Modes of every segment.
        wheels: Wheels and casters.
    """
    choices = {choice[0].id: choice for choice in modes}
    ever = wheels.never_dry
    count = 0
    for stroke, counts in zip(strokes, over, strict=True):
        for k in np.flatnonzero(counts).tolist():
            one, other = choices[stroke.id], choices[strokes[k].id]
            count += min(int(counts[k]), _least(one, other[0], ever), _least(other, one[0], ever))
    return count


def _least(modes: Sequence[Stroke], line: Stroke, wheels: Wheels) -> int:
    """Minimum number of crossings of a line while a segment is painted."""
    rows = wet_rows([line.nozzle])
    return min(int(wheels.crossings(stroke.path, 0.0, 0.0, rows).sum()) for stroke in modes)
