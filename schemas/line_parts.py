"""Parts of a template's lines, and the gaps between them."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from touchline.schemas.curves import Curve, wrap_angle
from touchline.schemas.template import ArcSpec, LineSpec, TemplateSegment

OVERLAP_M: Final = 0.005
"""Overlap where painting of a line resumes, as after a pause."""
DONE_M: Final = 0.02
"""Remainders of a line up to this length are not painted."""


def part_of(curve: Curve, from_m: float, to_m: float) -> Curve:
    """Cut a part out of a line or an arc."""
    x, y, heading, _ = (float(value) for value in curve.at(from_m))
    return replace(curve, x_m=x, y_m=y, heading_rad=wrap_angle(heading), length_m=to_m - from_m)


def redrawn(segment: TemplateSegment, curve: Curve, name: str = "") -> TemplateSegment:
    """Copy of a segment along another curve, with another id if that is given."""
    line: LineSpec | None = None
    arc: ArcSpec | None = None
    start = curve.x_m, curve.y_m
    if curve.curvature_1pm == 0.0:
        line = LineSpec(start=start, end=curve.end[:2])
    else:
        radius = 1.0 / curve.curvature_1pm
        center = start[0] - radius * math.sin(curve.heading_rad), start[1] + radius * math.cos(curve.heading_rad)
        arc = ArcSpec(start=start, center=center, sweep_angle=curve.curvature_1pm * curve.length_m)
    return segment.model_copy(update={"id": name or segment.id, "line": line, "arc": arc})


def gaps_between(spans: Iterable[tuple[float, float]], length_m: float) -> Iterator[tuple[float, float]]:
    """Yield the parts of a line, from and to (m), that no span covers, unless they are too short to be painted."""
    at_m = 0.0
    for from_m, to_m in [*sorted(spans), (length_m, length_m)]:
        if from_m - at_m > DONE_M:
            yield at_m, from_m
        at_m = max(at_m, to_m)


def with_overlap(curve: Curve, gap: tuple[float, float]) -> Curve:
    """Return the part of a curve that closes a gap, from and to (m), with `OVERLAP_M` at each joint."""
    return part_of(curve, max(gap[0] - OVERLAP_M, 0.0), min(gap[1] + OVERLAP_M, curve.length_m))
