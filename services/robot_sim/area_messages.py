"""Messages with the figures of areas."""

from __future__ import annotations

from touchline.schemas import messages as m
from touchline.services.robot_sim.accounting.area_metrics import AreaMetrics


def area_report(header: m.Header, metrics: AreaMetrics) -> m.AreaReport:
    """Make the report of all areas."""
    return m.AreaReport(
        header=header,
        area_m2=metrics.area_m2,
        covered_m2=metrics.covered_m2,
        coverage_pct=metrics.coverage_pct,
        reachable_m2=metrics.reachable_m2,
        of_reachable_pct=metrics.of_reachable_pct,
        planned_m2=metrics.planned_m2,
        of_planned_pct=metrics.of_planned_pct,
        overlap_m2=metrics.overlap_m2,
        missed_m2=metrics.missed_m2,
        body_outside_m=metrics.body_outside_m,
        lateral_error_mean_m=metrics.lateral.mean_m,
        lateral_error_p95_m=metrics.lateral.p95_m,
        lateral_error_max_m=metrics.lateral.max_m,
        missed=tuple(m.MissedPatch(x_m=patch.x_m, y_m=patch.y_m, area_m2=patch.area_m2) for patch in metrics.missed),
    )


def covering_report(header: m.Header, metrics: AreaMetrics, *, done: bool) -> m.TraversalReport:
    """Make the report of a traversal from the figures of its areas; there are no lines.

    Args:
        header: Header of the message.
        metrics: Figures of the areas.
        done: True if the traversal has reached its end.
    """
    return m.TraversalReport(
        header=header,
        success=done and metrics.verdict.accepted,
        coverage_pct=metrics.coverage_pct,
        area_coverage_pct=metrics.coverage_pct,
        within_tolerance_pct=metrics.of_planned_pct,
        paint_accepted=metrics.verdict.accepted,
        verdict=metrics.verdict.text,
        overspray_m2=metrics.beside_m2,
        double_paint_m2=metrics.overlap_m2,
        lateral_error_mean_m=metrics.lateral.mean_m,
        lateral_error_p95_m=metrics.lateral.p95_m,
        lateral_error_max_m=metrics.lateral.max_m,
        painted_length_m=metrics.distance_m,
    )
