"""Crossings of wet paint that no order of painting would do away with."""

from collections.abc import Sequence

import numpy as np

from services.planner.legs import Drive
from services.planner.offset import Stroke
from services.planner.wet import Wheels, wet_rows


def unavoidable_crossings(drive: Drive, modes: Sequence[Sequence[Stroke]], wheels: Wheels) -> int:
    """How many of a drive's crossings are of two segments of which the later one always runs over the other.

    That is so whichever of both comes first, and in all their `modes`; but for waiting, nothing helps.
    """
    choices = {choice[0].id: choice for choice in modes}
    ever = wheels.never_dry
    count = 0
    for stroke, over in zip(drive.strokes, drive.over, strict=True):
        for k in np.flatnonzero(over).tolist():
            one, other = choices[stroke.id], choices[drive.strokes[k].id]
            count += min(int(over[k]), _least(one, other[0], ever), _least(other, one[0], ever))
    return count


def _least(modes: Sequence[Stroke], line: Stroke, wheels: Wheels) -> int:
    """How often painting a segment runs over a line at the least."""
    rows = wet_rows([line.nozzle])
    return min(int(wheels.crossings(stroke.path, 0.0, 0.0, rows).sum()) for stroke in modes)
