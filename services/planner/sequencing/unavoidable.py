"""Crossings of wet paint that no order of painting avoids."""

from collections.abc import Sequence

import numpy as np

from touchline.services.planner.geometry.clothoid import Ints
from touchline.services.planner.sequencing.wet import Wheels, wet_rows
from touchline.services.planner.swaths.offset import Stroke


def unavoidable_crossings(
    strokes: Sequence[Stroke],
    over: Sequence[Ints],
    modes: Sequence[Sequence[Stroke]],
    wheels: Wheels,
) -> int:
    """The number of crossings that occur whichever of the two segments is painted first, and in whichever mode.

    Only waiting for the paint to dry would avoid them.

    Args:
        strokes: In driving order.
        over: For each stroke, how often those painted before it are run over while it is painted.
        modes: For every segment the ways to paint it.
        wheels: What touches the ground.
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
    """The least number of times that painting a segment runs over a line."""
    rows = wet_rows([line.nozzle])
    return min(int(wheels.crossings(stroke.path, 0.0, 0.0, rows).sum()) for stroke in modes)
