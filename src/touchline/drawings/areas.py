"""Strokes that fill the coloured areas of a drawing."""

import math
from collections.abc import Sequence

import numpy as np

from touchline.drawings.hatch import Ring, hatch
from touchline.drawings.outline import Outline
from touchline.schemas.curves import Curve
from touchline.schemas.plain_text import plain
from touchline.schemas.template import MIN_LENGTH_M, LineSpec, TemplateSegment

#: Arcs of areas become chords that stay this close.
CHORD_M = 1e-3


def fill_areas(
    fitted: Sequence[tuple[Outline, list[Curve]]], width_m: float, angle_rad: float, least_m: float
) -> list[TemplateSegment]:
    """Fill every coloured closed element with strokes; the parts of one path or of one hatch make one area.

    Args:
        fitted: Outlines and their lines and arcs.
        width_m: Width of a stroke.
        angle_rad: Direction of the strokes.
        least_m: Minimum length of a stroke.
    """
    areas: dict[str, list[Ring]] = {}
    for outline, curves in fitted:
        if outline.filled and outline.closed:
            areas.setdefault(outline.area or outline.name, []).append(_ring(curves))
    segments = []
    for name, rings in ((plain(area), rings) for area, rings in areas.items()):
        strokes = [stroke for stroke in hatch(rings, width_m, angle_rad) if math.dist(*stroke) >= least_m]
        for index, (start, end) in enumerate(strokes, 1):
            line = LineSpec(start=start, end=end)
            segments.append(TemplateSegment(id=f"{name[:70]}-fill-{index}", label=f"{name}, area", line=line))
    return segments


def _ring(curves: list[Curve]) -> Ring:
    points = []
    for curve in curves:
        sagitta_step = math.sqrt(8 * CHORD_M / abs(curve.curvature_1pm)) if curve.curvature_1pm else curve.length_m
        count = max(2, math.ceil(curve.length_m / max(sagitta_step, MIN_LENGTH_M)) + 1)
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count))
        points.append(np.column_stack((x, y)))
    return np.concatenate(points)
