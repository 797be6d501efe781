"""Figures of a plan and of a run, as JSON objects."""

import math
from collections.abc import Sequence
from typing import Any

from touchline.core.plain_sum import plain_sum
from touchline.schemas.messages import (
    AreaReport,
    ContactReport,
    LeftOutStretch,
    PlannedCoverage,
    PlanReport,
    SegmentPaint,
    TraversalReport,
)


def plan_figures(report: PlanReport) -> dict[str, Any]:
    """Return the plan report: lengths, times, counts, largest values and gaps of the planned trajectory.

    A stepping curvature has no finite sharpness, and JSON no infinity: it is ``None``, as are the actuators' rates.
    """
    return {
        "length_m": {
            "paint": report.paint_length_m,
            "transition": report.transition_length_m,
            "total": report.total_length_m,
        },
        "time_s": {
            "paint": report.paint_time_s,
            "transition": report.transition_time_s,
            "total": report.total_time_s,
        },
        "segments": {"painted": report.painted_segments, "transitions": report.transitions},
        "max": {
            "curvature_1pm": report.max_curvature_1pm,
            "sharpness_1pm2": _finite(report.max_sharpness_1pm2),
            "lateral_acceleration_mps2": report.max_lateral_acceleration_mps2,
        },
        "actuators": {
            actuator.name: {
                "quantity": actuator.quantity,
                "unit": actuator.unit,
                "max": actuator.max,
                "max_rate": _finite(actuator.max_rate),
            }
            for actuator in report.actuators
        },
        "continuity": {
            "position_gap_m": report.position_gap_m,
            "heading_gap_rad": report.heading_gap_rad,
            "curvature_step_1pm": report.max_curvature_step_1pm,
        },
        "standstills": {"cusps": report.cusps, "spins": report.spins},
        "wet_crossings": {"total": report.wet_crossings, "unavoidable": report.wet_crossings_unavoidable},
        "estimate": {"paint_l": report.paint_l, "battery_wh": report.battery_wh},
        **({"coverage": planned_coverage_figures(report.coverage)} if report.coverage else {}),
        **({"left_out": left_out_figures(report.left_out)} if report.left_out else {}),
        "planning_time_s": report.planning_time_s,
    }


def planned_coverage_figures(areas: Sequence[PlannedCoverage]) -> dict[str, Any]:
    """Return a plan's coverage of its areas, all together."""
    area_m2, covered_m2 = plain_sum(each.area_m2 for each in areas), plain_sum(each.covered_m2 for each in areas)
    reachable_m2 = plain_sum(each.reachable_m2 for each in areas)
    reached_m2 = plain_sum(0.01 * each.reachable_pct * each.reachable_m2 for each in areas)
    return {
        "method": areas[0].method,
        "area_m2": area_m2,
        "covered_m2": covered_m2,
        "coverage_pct": 100.0 * covered_m2 / area_m2,
        "of_reachable_pct": 100.0 * reached_m2 / reachable_m2 if reachable_m2 else 100.0,
        "reachable_m2": reachable_m2,
        "overlap_m2": plain_sum(each.overlap_m2 for each in areas),
        "body_outside_m": max(each.body_outside_m for each in areas),
        "lanes": sum(each.lanes for each in areas),
        "laps": sum(each.laps for each in areas),
        "swath_angle_deg": areas[0].swath_angle_deg,
        "notes": [note for each in areas for note in each.notes],
        "missed": [
            {"x_m": patch.x_m, "y_m": patch.y_m, "area_m2": patch.area_m2} for each in areas for patch in each.missed
        ],
    }


def left_out_figures(stretches: Sequence[LeftOutStretch]) -> dict[str, Any]:
    """Return the parts of lines that a plan leaves out as obstructed."""
    return {
        "total_m": math.fsum(each.length_m for each in stretches),
        "stretches": [
            {
                "line": each.line_id,
                "outline": each.outline,
                "length_m": each.length_m,
                "along_m": [each.from_m, each.to_m],
                "from_m": [each.from_x_m, each.from_y_m],
                "to_m": [each.to_x_m, each.to_y_m],
            }
            for each in stretches
        ],
    }


def paint_figures(report: TraversalReport) -> dict[str, Any]:
    """Return the paint's figures against the template."""
    return {
        "coverage_pct": report.coverage_pct,
        "area_coverage_pct": report.area_coverage_pct,
        "gap_m": report.gap_m,
        "overspray_m2": report.overspray_m2,
        "double_paint_m2": report.double_paint_m2,
        "lateral_error_m": _lateral_error(report),
        "wet_crossings": report.wet_crossings,
        "wet_youngest_s": report.wet_youngest_s if report.wet_crossings else None,
        "smears": len(report.smears),
        "smeared_m2": report.smeared_m2,
        "accepted": report.paint_accepted,
        "tolerance_m": report.tolerance_m,
        "within_tolerance_pct": report.within_tolerance_pct,
        "verdict": report.verdict,
    }


def failing(report: TraversalReport, area: AreaReport | None = None, contacts: ContactReport | None = None) -> str:
    """Return why a finished traversal is no success; "" if it is one."""
    what = "paint" if area is None else "work"
    return hit_something(contacts) or ("" if report.paint_accepted else f"the {what} is not accepted: {report.verdict}")


def hit_something(contacts: ContactReport | None) -> str:
    """Return the number of contacts while moving, in words with the first; "" without any."""
    if contacts is None or not contacts.while_moving:
        return ""
    first = next(each for each in contacts.contacts if each.robot_mps > 0.0)
    return f"{contacts.while_moving} contacts while moving, the first with {first.thing} at {first.robot_mps:.2f} m/s"


def all_contacts(reports: Sequence[ContactReport | None]) -> ContactReport | None:
    """Return the contacts of all drives in one report; None if there were none."""
    found = [report for report in reports if report is not None]
    if not found:
        return None
    contacts = tuple(each for report in found for each in report.contacts)
    return found[-1].model_copy(
        update={"contacts": contacts, "while_moving": sum(report.while_moving for report in found)}
    )


def work_report(report: TraversalReport, area: AreaReport | None, plan: PlanReport) -> dict[str, Any]:
    """Return the robot's report: of areas, if a covering tool has worked on some, or else of paint.

    Where the plan leaves out some of the lines, the figures are of the rest, and the share of all lines stands beside.

    Args:
        report: Report of the traversal.
        area: Report of its areas, if a covering tool has worked on some.
        plan: Report of its plan.
    """
    if area is None:
        figures = paint_report(report)
        if plan.left_out:
            reached_m = math.fsum(each.length_m for each in report.segments)
            figures["paint"] |= all_lines_figures(plan.left_out, reached_m, report.coverage_pct)
        return figures
    return {"area": area_report_figures(area, report), "estimator": estimator_figures(report)}


def all_lines_figures(left_out: Sequence[LeftOutStretch], reached_m: float, coverage_pct: float) -> dict[str, float]:
    """Return the length that is left out, and the coverage of all lines.

    Args:
        left_out: Stretches that are left out.
        reached_m: Length of the rest.
        coverage_pct: Coverage of the rest.
    """
    left_out_m = math.fsum(each.length_m for each in left_out)
    share = reached_m / (reached_m + left_out_m) if reached_m else 0.0
    return {"left_out_m": left_out_m, "of_all_lines_pct": share * coverage_pct}


def contact_figures(contacts: ContactReport | None) -> dict[str, Any]:
    """Return contacts with things, while the robot moved apart from those into the robot at rest; nothing without."""
    if contacts is None:
        return {}
    listed = [
        {
            "time_s": each.stamp.seconds,
            "thing": each.thing,
            "x_m": each.x_m,
            "y_m": each.y_m,
            "robot_mps": each.robot_mps,
            "closing_mps": each.closing_mps,
            "energy_j": each.energy_j,
        }
        for each in contacts.contacts
    ]
    at_rest = len(listed) - contacts.while_moving
    return {"contacts": {"while_moving": contacts.while_moving, "at_rest": at_rest, "each": listed}}


def area_report_figures(area: AreaReport, report: TraversalReport) -> dict[str, Any]:
    """Return all figures of areas and body, with the verdict."""
    return {
        **area_figures(area),
        "accepted": report.paint_accepted,
        "verdict": report.verdict,
        "missed": [{"x_m": patch.x_m, "y_m": patch.y_m, "area_m2": patch.area_m2} for patch in area.missed],
    }


def area_figures(area: AreaReport) -> dict[str, Any]:
    """Return the main figures of areas that a covering tool has worked on."""
    return {
        "area_m2": area.area_m2,
        "covered_m2": area.covered_m2,
        "coverage_pct": area.coverage_pct,
        "of_reachable_pct": area.of_reachable_pct,
        "of_planned_pct": area.of_planned_pct,
        "reachable_m2": area.reachable_m2,
        "planned_m2": area.planned_m2,
        "missed_m2": area.missed_m2,
        "patches": len(area.missed),
        "overlap_m2": area.overlap_m2,
        "body_outside_m": area.body_outside_m,
        "lateral_error_m": _lateral_error(area),
    }


def paint_report(report: TraversalReport) -> dict[str, Any]:
    """Return all figures of paint, as a whole and line by line, and of the estimate."""
    return {
        "paint": paint_figures(report),
        "segments": [segment_figures(segment) for segment in report.segments],
        "estimator": estimator_figures(report),
    }


def segment_figures(segment: SegmentPaint) -> dict[str, Any]:
    """Return the figures of one painted line."""
    return {
        "id": segment.id,
        "length_m": segment.length_m,
        "coverage_pct": segment.coverage_pct,
        "area_coverage_pct": segment.area_coverage_pct,
        "within_tolerance_pct": segment.within_tolerance_pct,
        "gap_m": segment.gap_m,
        "width_m": segment.width_m,
        "overspray_m2": segment.overspray_m2,
        "double_paint_m2": segment.double_paint_m2,
        "lateral_error_m": _lateral_error(segment),
    }


def traversal_figures(report: TraversalReport, wall_time_s: float) -> dict[str, Any]:
    """Return the duration of the drive, in sim time and wall clock."""
    return {
        "total_time_s": report.total_time_s,
        "wall_time_s": wall_time_s,
        "real_time_factor": report.total_time_s / wall_time_s,
        "follower_fallbacks": report.follower_fallbacks,
    }


def hash_figures(scenario: str, report: TraversalReport) -> dict[str, Any]:
    """Return scenario hash and session hash (``None`` if it was not computed)."""
    return {"scenario": scenario, "session": report.session_hash or None}


def estimator_figures(report: TraversalReport) -> dict[str, Any]:
    """Return the error of the estimated pose."""
    return {"position_rmse_m": report.position_rmse_m, "heading_rmse_rad": report.heading_rmse_rad}


def _lateral_error(painted: TraversalReport | SegmentPaint | AreaReport) -> dict[str, float]:
    return {
        "mean": painted.lateral_error_mean_m,
        "p95": painted.lateral_error_p95_m,
        "max": painted.lateral_error_max_m,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
