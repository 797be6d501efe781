"""Planning of a template: the whole algorithm, line by line."""

from collections.abc import Callable
from dataclasses import dataclass

from touchline.schemas.messages import PlanOptions, PlanReport, Trajectory
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Progress
from touchline.services.planner.coverage.area_method import CoverageMethod, named_once
from touchline.services.planner.coverage.covering import covered
from touchline.services.planner.coverage.guarded_coverage import guarded_area_method
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import marked
from touchline.services.planner.output.measure import measure
from touchline.services.planner.output.message import trajectory_message
from touchline.services.planner.plan_task import ALONE, Company, PlanTask
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import Section
from touchline.services.planner.segments.sent_segments import Sent, send
from touchline.services.planner.speed.actuation import PaintedStretch, actuation_profile
from touchline.services.planner.speed.path_grid import course
from touchline.services.planner.speed.timing import SpeedProfile, Steady, speed_profile


@dataclass(frozen=True)
class Plan:
    """A planned template.

    Attributes:
        trajectory: Message to send.
        report: Figures of the plan.
        sections: Ideal curve.
        sent: Lines and arcs that approximate it.
        painted: Intervals of arc length (as sent) in which paint flows.
        speeds: Speeds along what is sent.
        limits: Limits of the plan.
        notes: Sentences about choices that the request left open.
    """

    trajectory: Trajectory
    report: PlanReport
    sections: list[Section]
    sent: list[Sent]
    painted: list[PaintedStretch]
    speeds: SpeedProfile
    limits: Limits
    notes: tuple[str, ...] = ()


def plan(
    template: Template,
    vehicle: Vehicle,
    options: PlanOptions | None = None,
    progress: Progress = lambda stage, fraction: None,
    enough: Callable[[], bool] = lambda: False,
    company: Company = ALONE,
) -> Plan:
    """Plan the trajectory that paints a template.

    The report's planning time stays 0, as the core knows no clock.

    Args:
        template: Template in the map frame.
        vehicle: Vehicle that paints it.
        options: Options of the plan; by default the vehicle's.
        progress: Called with the stage and the fraction of it that is done; may raise to end planning.
        enough: Returns whether to take the best order so far.
        company: Other robots on the same ground.

    Raises:
        PlanningError: An option, a segment or an area cannot be met.
    """
    task = PlanTask(template, vehicle, named_once(options or PlanOptions()), company)
    method = guarded_area_method(task.options, vehicle.tool)
    if isinstance(method, CoverageMethod) and template.areas:
        worked = covered(task, method, progress)
    else:
        worked = marked(task, progress, enough)
    sections = worked.sections
    sent = send(sections, lambda done: progress("cutting into arcs", done))

    painted = [PaintedStretch(s.id, s.start_m, s.end_m, s.stroke.actuation) for s in sent if s.stroke]
    steady = _steady(painted, [s.speed_mps for s in sections if s.stroke], vehicle)
    borders = [border for stretch in steady for border in stretch[:2]]
    speeds = speed_profile(course(sections, sent, borders, task.limits), steady, task.limits)
    progress("speeds", 1.0)

    made = finished(worked, sent, painted, speeds, vehicle, task.limits)
    progress("report", 1.0)
    return made


def finished(
    worked: WorkedRoute,
    sent: list[Sent],
    painted: list[PaintedStretch],
    speeds: SpeedProfile,
    vehicle: Vehicle,
    limits: Limits,
) -> Plan:
    """Complete a plan of known path and speeds with its message and report.

    Args:
        worked: Ideal curve, and the work along it.
        sent: Lines and arcs that approximate it.
        painted: Intervals of arc length (as sent) in which paint flows.
        speeds: Speeds along what is sent.
        vehicle: Vehicle that drives it.
        limits: Limits of the plan.
    """
    switches = actuation_profile(painted, speeds, vehicle)
    trajectory = trajectory_message(sent, speeds, switches)
    report = measure(trajectory, worked, sent, speeds, vehicle)
    return Plan(trajectory, report, worked.sections, sent, painted, speeds, limits)


def _steady(painted: list[PaintedStretch], speeds_mps: list[float], vehicle: Vehicle) -> list[Steady]:
    """Constant speed along each line, from the command that starts the tool to the line's end."""
    if not vehicle.tool.steady_speed:
        return []
    return [
        Steady(line.start_m - vehicle.tool.opens_s * speed, line.end_m, speed)
        for line, speed in zip(painted, speeds_mps, strict=True)
    ]
