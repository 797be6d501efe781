"""The figures of a painted session against what should have been painted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from services.robot_sim.paint.areas import paint_areas
from services.robot_sim.paint.ledger import PaintLedger


class LateralError(NamedTuple):
    """Distance of the nozzle from its line over the painted ticks [m]; zeros when nothing was painted."""

    mean_m: float
    p95_m: float
    max_m: float


class SegmentMetrics(NamedTuple):
    """One line's figures."""

    id: str
    length_m: float
    covered_m: float
    lateral: LateralError


class PaintMetrics(NamedTuple):
    """The whole session's figures; areas as in `paint_areas`."""

    coverage_pct: float
    gap_m: float
    painted_length_m: float
    """Driven with the valve open, wherever that was."""
    template_length_m: float
    painted_m2: float
    overspray_m2: float
    double_paint_m2: float
    lateral: LateralError
    segments: list[SegmentMetrics]


def paint_metrics(ledger: PaintLedger) -> PaintMetrics:
    """Work out everything; the areas take a moment, so once at the end."""
    deviation = ledger.deviation()
    distance = np.abs(deviation.lateral_m)
    segments = [
        SegmentMetrics(
            target.id, target.curve.length_m, covered.length, _lateral_error(distance[deviation.target == index])
        )
        for index, (target, covered) in enumerate(zip(ledger.targets, ledger.covered, strict=True))
    ]
    lines = [target.curve for target in ledger.targets]
    areas = paint_areas(ledger.strokes, lines, ledger.spray_width_m, ledger.line_width_m)
    painted = sum(float(np.hypot(np.diff(s.x_m), np.diff(s.y_m)).sum()) for s in ledger.strokes)
    return PaintMetrics(
        coverage_pct=ledger.coverage_pct,
        gap_m=max(0.0, ledger.length_m - ledger.covered_m),
        painted_length_m=painted,
        template_length_m=ledger.length_m,
        painted_m2=areas.painted_m2,
        overspray_m2=areas.overspray_m2,
        double_paint_m2=areas.double_paint_m2,
        lateral=_lateral_error(distance),
        segments=segments,
    )


def _lateral_error(distance_m: np.ndarray) -> LateralError:
    if not len(distance_m):
        return LateralError(0.0, 0.0, 0.0)
    return LateralError(float(np.mean(distance_m)), float(np.quantile(distance_m, 0.95)), float(np.max(distance_m)))
