"""Figures of the paint of a session against the lines to be painted."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.plain_sum import plain_sum
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.paint_areas import paint_areas
from touchline.services.robot_sim.paint.segment_metrics import LateralError, SegmentMetrics
from touchline.services.robot_sim.paint.verdict import Verdict, verdict


class PaintMetrics(NamedTuple):
    """Figures of the whole session; areas as in `paint_areas`."""

    coverage_pct: float
    """Share of the length."""
    area_coverage_pct: float
    within_pct: float
    """Share of the length with the middle of the paint within the tolerance."""
    verdict: Verdict
    gap_m: float
    painted_length_m: float
    """Distance driven with the valve open, on lines or elsewhere."""
    template_length_m: float
    painted_m2: float
    overspray_m2: float
    double_paint_m2: float
    lateral: LateralError
    segments: list[SegmentMetrics]


def paint_metrics(ledger: PaintLedger) -> PaintMetrics:
    """Compute all figures; the areas take a moment, so it is done once at the end."""
    deviation = ledger.deviation()
    distance = np.abs(deviation.lateral_m)
    strokes = ledger.strokes()
    lines = [target.curve for target in ledger.targets]
    areas = paint_areas(strokes, ledger.strokes_by_target(), lines, ledger.line_width_m)
    within, drawn = ledger.within_by_target_m(ledger.tolerance_m), ledger.drawn_by_target_m()
    order = np.argsort(deviation.target, kind="stable")
    parts = np.split(distance[order], np.searchsorted(deviation.target[order], np.arange(1, len(lines))))
    segments = [
        SegmentMetrics(
            target.id,
            target.curve.length_m,
            covered_m,
            within_m,
            area.painted_m2 / drawn_m if drawn_m > 0.0 else 0.0,
            area,
            lateral_error(part),
        )
        for target, covered_m, within_m, drawn_m, area, part in zip(
            ledger.targets, ledger.covered_by_target_m.tolist(), within, drawn, areas.lines, parts, strict=False
        )
    ]
    painted = plain_sum(float(np.hypot(*np.diff(stroke.points, axis=0).T).sum()) for stroke in strokes)
    within_pct = _share_pct(math.fsum(within), ledger.length_m)
    return PaintMetrics(
        coverage_pct=ledger.coverage_pct,
        area_coverage_pct=_share_pct(areas.total.covered_m2, areas.total.wanted_m2),
        within_pct=within_pct,
        verdict=verdict(segments, within_pct, ledger.tolerance_m),
        gap_m=max(0.0, ledger.length_m - ledger.covered_m),
        painted_length_m=painted,
        template_length_m=ledger.length_m,
        painted_m2=areas.total.painted_m2,
        overspray_m2=areas.total.overspray_m2,
        double_paint_m2=areas.total.double_paint_m2,
        lateral=lateral_error(distance),
        segments=segments,
    )


def _share_pct(part: float, whole: float) -> float:
    """Return the percentage; 100 if the whole is empty."""
    return min(100.0, 100.0 * part / whole) if whole > 0.0 else 100.0


def lateral_error(distance_m: NDArray[np.float64]) -> LateralError:
    """Compute the figures of distances (n,) [m]."""
    if not len(distance_m):
        return LateralError(0.0, 0.0, 0.0)
    return LateralError(float(np.mean(distance_m)), float(np.quantile(distance_m, 0.95)), float(np.max(distance_m)))
