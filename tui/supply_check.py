"""Comparison of the needs of the job in view with the reported levels of tank and battery."""

from __future__ import annotations

from touchline.schemas import supplies
from touchline.schemas.messages.plan_messages import PlanReport
from touchline.schemas.supplies import Supplies
from touchline.tui.state import ConsoleState


def of_job(state: ConsoleState) -> Supplies:
    """Needs and levels for the remaining part of the job in view, as far as they are known."""
    robot, report = state.robot, _report(state)
    if report is not None and state.path_loaded and robot.status is not None:  # of a job that goes on, the rest
        paint_l = report.paint_l * (1.0 - robot.status.coverage_pct / 100.0)
        battery_wh = report.battery_wh * (1.0 - (robot.driven_fraction or 0.0))
        report = report.model_copy(update={"paint_l": paint_l, "battery_wh": battery_wh})
    tank_l = robot.sprayer.tank_l if robot.sprayer else None
    charge = robot.battery.percentage if robot.battery else None
    return supplies.supplies(report, state.vehicle, tank_l, charge)


def _report(state: ConsoleState) -> PlanReport | None:
    """Report of the plan; for another console's plan, the paint that lines and areas take."""
    if state.path is None:
        return None
    if state.path.report is not None:
        return state.path.report
    if state.template is None:
        return None
    template, tool = state.template.template, state.vehicle.tool
    if not tool.paints:
        return PlanReport()
    painted_m = template.length_m + template.area_m2 / tool.width_m
    return PlanReport(paint_l=tool.flow_lps / tool.work_speed_mps * painted_m)
