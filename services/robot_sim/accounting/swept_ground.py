"""Ground that strokes of a covering tool pass over, exact on polygons; see `paint.paint_areas` for its error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import union
from touchline.services.robot_sim.paint.ledger import PaintStroke
from touchline.services.robot_sim.paint.paint_areas import overlaps, passes_of, pieces_of, simplified, strip

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

STEP_M: Final = 1e-3
"""Resolution of strokes: before a standstill points lie nanometres apart, in any direction."""
_SHARP_RAD: Final = 0.1
"""Turn from which a bend tighter than half the tool's width is cut; what is missing there is in proportion to it."""
_FAN_RAD: Final = 0.3
"""Turn of the parts into which such a bend is cut, at most, but for its points."""

Floats = NDArray[np.float64]


class SweptGround(NamedTuple):
    """Ground passed over, and its part passed over more than once."""

    swept: BaseGeometry
    twice: BaseGeometry


def swept_ground(strokes: Sequence[PaintStroke]) -> SweptGround:
    """Compute the ground under the flat-ended strips of strokes; where a stroke turns back, another strip begins."""
    looked_at = [thinned(stroke, STEP_M) for stroke in strokes]
    passes = passes_of(looked_at)
    joints = (joint for stroke in looked_at for joint in _joints(stroke))
    bends = (part for stroke in looked_at for part in _sharp_bends(stroke))
    return SweptGround(union([*passes, *joints, *bends]), overlaps(passes))


def _joints(stroke: PaintStroke) -> Iterator[BaseGeometry]:
    """Yield the ground between the flat ends of strips that continue in a bend, even if it is only a sliver."""
    for before, after in pairwise(pieces_of(stroke.points)):
        corner = np.vstack((before[-2:], after[1:2]))
        (ax, ay), (bx, by) = np.diff(corner, axis=0).tolist()
        if ax * bx + ay * by > 0.0:
            yield strip(corner, stroke.width_m)


def _sharp_bends(stroke: PaintStroke) -> Iterator[BaseGeometry]:
    """Yield the ground under the pieces of a stroke that have bends tighter than half its width, cut at these.

    Inside such a bend, as where a turn on the spot begins, the tool goes back over what it has covered; there the strip
    of the whole piece has a hole.
    """
    for piece in pieces_of(stroke.points):
        bends = _cut_bends(piece, 0.5 * stroke.width_m)
        cuts = [place for bend in bends for place in bend]
        for first, last in pairwise((0, *cuts, len(piece) - 1) if cuts else ()):
            yield strip(simplified(piece[first : last + 1]), stroke.width_m)
        for bend in bends:
            yield from _fans(piece, bend, 0.5 * stroke.width_m)


def _cut_bends(piece: Floats, half_m: float) -> list[list[int]]:
    """Return of every sharp bend of a piece the points where it begins, has turned by `_FAN_RAD`, and ends."""
    ahead = np.diff(piece, axis=0)
    lengths, across = np.hypot(*ahead.T), ahead[:-1, 0] * ahead[1:, 1] - ahead[:-1, 1] * ahead[1:, 0]
    turns = np.abs(np.arctan2(across, (ahead[:-1] * ahead[1:]).sum(1)))  # at the second point, and so on
    tight = half_m * turns > 0.5 * (lengths[:-1] + lengths[1:])
    edges = np.flatnonzero(np.diff(np.concatenate(([False], tight, [False]))))
    bends = list[list[int]]()
    for first, end in edges.reshape(-1, 2).tolist():
        turned = np.cumsum(turns[first:end])
        if turned[-1] > _SHARP_RAD:
            fans = first + 1 + np.flatnonzero(np.diff(np.floor(turned / _FAN_RAD)))
            bends.append(sorted({first + 1, *(fans + 1).tolist(), end}))
    return bends


def _fans(piece: Floats, bend: Sequence[int], half_m: float) -> Iterator[BaseGeometry]:
    """Yield the ground that both halves of the tool's line pass over in a bend; `bend` has points as `_cut_bends`."""
    import shapely

    segments = [place + after for place in bend for after in (-1, 0)]
    middles = piece[np.repeat(bend, 2)]
    ahead = piece[np.array(segments) + 1] - piece[segments]
    aside = half_m * np.column_stack((-ahead[:, 1], ahead[:, 0])) / np.hypot(*ahead.T)[:, None]
    for ends in (middles + aside, middles - aside):
        for first in range(len(segments) - 1):
            yield shapely.MultiPoint(np.vstack((middles[first : first + 2], ends[first : first + 2]))).convex_hull


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
