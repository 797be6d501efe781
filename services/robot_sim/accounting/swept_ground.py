"""Ground that strokes of a covering tool pass over, exact on polygons; see `paint.paint_areas` for its error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from touchline.core.robust_overlay import union
from touchline.services.robot_sim.paint.ledger import PaintStroke
from touchline.services.robot_sim.paint.paint_areas import overlaps, passes_of, pieces_of, strip

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

STEP_M: Final = 1e-3
"""Resolution of strokes: before a standstill points lie nanometres apart, in any direction."""


class SweptGround(NamedTuple):
    """Ground passed over, and its part passed over more than once."""

    swept: BaseGeometry
    twice: BaseGeometry


def swept_ground(strokes: Sequence[PaintStroke]) -> SweptGround:
    """Compute the ground under the flat-ended strips of strokes; where a stroke turns back, another strip begins."""
    looked_at = [thinned(stroke, STEP_M) for stroke in strokes]
    passes = passes_of(looked_at)
    joints = (joint for stroke in looked_at for joint in _joints(stroke))
    return SweptGround(union([*passes, *joints]), overlaps(passes))


def _joints(stroke: PaintStroke) -> Iterator[BaseGeometry]:
    """Yield the ground between the flat ends of strips that continue in a bend, even if it is only a sliver."""
    for before, after in pairwise(pieces_of(stroke.points)):
        corner = np.vstack((before[-2:], after[1:2]))
        (ax, ay), (bx, by) = np.diff(corner, axis=0).tolist()
        if ax * bx + ay * by > 0.0:
            yield strip(corner, stroke.width_m)


def thinned(stroke: PaintStroke, step_m: float) -> PaintStroke:
    """Remove the points of a stroke that are less than a step from the one before; the last one is kept.

    Args:
        stroke: The stroke.
        step_m: Resolution.
    """
    at = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(stroke.points, axis=0).T))))
    keep = np.concatenate(([True], np.diff(np.floor(at / step_m)) > 0.0))
    keep[-1] = True
    return PaintStroke(stroke.points[keep], stroke.width_m)
