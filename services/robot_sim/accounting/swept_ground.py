"""The ground that strokes of a covering tool pass over, exact on polygons; see `paint.paint_areas` for its error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from touchline.services.robot_sim.paint.ledger import PaintStroke
from touchline.services.robot_sim.paint.paint_areas import overlaps, passes_of

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

STEP_M: Final = 1e-3
"""Strokes are looked at no more finely: on their way to a standstill points lie nanometres apart, in any direction."""


class SweptGround(NamedTuple):
    """What was passed over, and what of it more than once."""

    swept: BaseGeometry
    twice: BaseGeometry


def swept_ground(strokes: Sequence[PaintStroke]) -> SweptGround:
    """What the flat-ended strips of strokes cover; where a stroke turns back, another strip begins."""
    import shapely

    passes = passes_of([thinned(stroke, STEP_M) for stroke in strokes])
    return SweptGround(shapely.union_all(passes), overlaps(passes))


def thinned(stroke: PaintStroke, step_m: float) -> PaintStroke:
    """A stroke without the points that are less than a step from the one before; its last one stays."""
    at = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(stroke.points, axis=0).T))))
    keep = np.concatenate(([True], np.diff(np.floor(at / step_m)) > 0.0))
    keep[-1] = True
    return PaintStroke(stroke.points[keep], stroke.width_m)
