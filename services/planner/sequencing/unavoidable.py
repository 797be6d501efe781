"""Crossings of wet paint that no order of painting would do away with."""

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
    """How many crossings are of two segments of which the later one always runs over the other.

    `over` says for each of the `strokes`, in driving order, how often those painted before it are run over while it is
    painted. A crossing counts if it is there whichever of both comes first, and in all their `modes`; but for waiting,
    nothing helps.
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
    """How often painting a segment runs over a line at the least."""
    rows = wet_rows([line.nozzle])
    return min(int(wheels.crossings(stroke.path, 0.0, 0.0, rows).sum()) for stroke in modes)
