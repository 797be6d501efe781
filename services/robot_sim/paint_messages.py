"""Messages with the figures of paint."""

from __future__ import annotations

from touchline.schemas import messages as m
from touchline.services.robot_sim.paint.metrics import PaintMetrics
from touchline.services.robot_sim.paint.segment_metrics import SegmentMetrics


def painting_report(header: m.Header, metrics: PaintMetrics, tolerance_m: float, *, done: bool) -> m.TraversalReport:
    """Make the report of a traversal from the figures of its paint.

    Args:
        header: Header of the message.
        metrics: Figures of the paint.
        tolerance_m: Tolerance of the template.
        done: True if the traversal has reached its end.
    """
    return m.TraversalReport(
        header=header,
        success=done and metrics.verdict.accepted,
        coverage_pct=metrics.coverage_pct,
        area_coverage_pct=metrics.area_coverage_pct,
        tolerance_m=tolerance_m,
        within_tolerance_pct=metrics.within_pct,
        paint_accepted=metrics.verdict.accepted,
        verdict=metrics.verdict.text,
        gap_m=metrics.gap_m,
        overspray_m2=metrics.overspray_m2,
        double_paint_m2=metrics.double_paint_m2,
        lateral_error_mean_m=metrics.lateral.mean_m,
        lateral_error_p95_m=metrics.lateral.p95_m,
        lateral_error_max_m=metrics.lateral.max_m,
        painted_length_m=metrics.painted_length_m,
        template_length_m=metrics.template_length_m,
        segments=tuple(_segment(segment) for segment in metrics.segments),
    )


def _segment(segment: SegmentMetrics) -> m.SegmentPaint:
    return m.SegmentPaint(
        id=segment.id,
        length_m=segment.length_m,
        coverage_pct=segment.coverage_pct,
        area_coverage_pct=segment.area_coverage_pct,
        within_tolerance_pct=segment.within_pct,
        gap_m=segment.gap_m,
        width_m=segment.width_m,
        overspray_m2=segment.areas.overspray_m2,
        double_paint_m2=segment.areas.double_paint_m2,
        lateral_error_mean_m=segment.lateral.mean_m,
        lateral_error_p95_m=segment.lateral.p95_m,
        lateral_error_max_m=segment.lateral.max_m,
    )
