"""The job in view against the robot's tank and battery as it tells them now."""

from __future__ import annotations

from touchline.schemas import supplies
from touchline.schemas.messages.touchline import PlanReport
from touchline.schemas.supplies import Supplies
from touchline.tui.state import ConsoleState


def of_job(state: ConsoleState) -> Supplies:
    """What the job in view needs and what is there for it; of both what is known."""
    robot = state.robot
    tank_l = robot.sprayer.tank_l if robot.sprayer else None
    charge = robot.battery.percentage if robot.battery else None
    return supplies.supplies(_report(state), state.vehicle, tank_l, charge)


def _report(state: ConsoleState) -> PlanReport | None:
    """The plan's own figures; of another console's plan the paint that lines and areas take."""
    if state.path is None:
        return None
    if state.path.report is not None:
        return state.path.report
    if state.template is None:
        return None
    template, vehicle = state.template.template, state.vehicle
    painted_m = template.length_m + template.area_m2 / vehicle.tool.spray_width_m
    return PlanReport(paint_l=vehicle.tool.paint_l_per_m * painted_m)
