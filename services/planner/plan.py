"""Plan a template: the whole algorithm, line by line."""

from collections.abc import Callable
from dataclasses import dataclass

from schemas.errors import PlanningError
from schemas.messages import PlanOptions, PlanReport, Trajectory
from schemas.template import Template
from schemas.vehicle import Vehicle
from services.planner.actuation import Painted, actuation_profile
from services.planner.ccd import ContinuousDubins
from services.planner.clothoid import Pose
from services.planner.dubins_padded import PaddedDubins
from services.planner.limits import Limits
from services.planner.measure import measure
from services.planner.method import TransitionMethod
from services.planner.offset import strokes
from services.planner.output import Sent, send, trajectory_message
from services.planner.route import Section, route
from services.planner.timing import Cap, SpeedProfile, Steady, speed_profile


def _steering(limits: Limits) -> TransitionMethod:
    # Compiled kernels take half a second to load, which nobody should wait for before there is something to plan.
    from services.planner.steering.steer import Steering

    return Steering(limits.curvature_max_1pm, limits.sharpness_max_1pm2)


METHODS: dict[str, Callable[[Limits], TransitionMethod]] = {
    "g2": _steering,
    ContinuousDubins.name: lambda limits: ContinuousDubins(limits.curvature_max_1pm, limits.sharpness_max_1pm2),
    PaddedDubins.name: lambda limits: PaddedDubins(limits.curvature_max_1pm),
}
DEFAULT_METHOD = "g2"

# A start pose further out than this (m) is a mistake.
START_MAX = 20_000.0

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Plan:
    """A planned template.

    `trajectory` is what is sent and `report` its figures; `sections` hold the ideal curve, `sent` the lines and arcs
    that stand for it, `painted` the arc lengths of what is sent between which paint flows, `speeds` the speed along it.
    """

    trajectory: Trajectory
    report: PlanReport
    sections: list[Section]
    sent: list[Sent]
    painted: list[Painted]
    speeds: SpeedProfile
    limits: Limits


def plan(
    template: Template,
    vehicle: Vehicle,
    options: PlanOptions | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> Plan:
    """The trajectory that paints `template`, segments in its order, with `vehicle`.

    `progress` is told the stage and the fraction of it that is done. The report's planning time is left at 0: the core
    knows no clock.

    Raises:
        PlanningError: An option or a segment cannot be met; it names which and what to do.
    """
    options = options or PlanOptions()
    limits = Limits.of(vehicle, options)
    method = transition_method(options.method, limits)

    lines = strokes(template.segments, vehicle, limits.curvature_max_1pm)
    sections = route(lines, method, limits, _start(options), lambda done: progress("transitions", done))
    sent = send(sections, lambda done: progress("cutting into arcs", done))

    painted = [Painted(s.id, s.start_m, s.end_m, s.stroke.actuation) for s in sent if s.stroke]
    speeds = speed_profile(_caps(sent, limits), _steady(painted, limits, vehicle))
    progress("speeds", 1.0)

    switches = actuation_profile(painted, speeds, vehicle)
    trajectory = trajectory_message(sent, speeds, switches)
    report = measure(trajectory, sections, sent, speeds, vehicle)
    progress("report", 1.0)
    return Plan(trajectory, report, sections, sent, painted, speeds, limits)


def transition_method(name: str, limits: Limits) -> TransitionMethod:
    """The transition method of that name ("" is the default).

    Raises:
        PlanningError: There is no such method.
    """
    make = METHODS.get(name or DEFAULT_METHOD)
    if make is None:
        raise PlanningError("", f'asks for the unknown method "{name}"', f"use one of: {', '.join(METHODS)}")
    return make(limits)


def _start(options: PlanOptions) -> Pose | None:
    if not len(options.start):
        return None
    start = Pose(*options.start.tolist()) if len(options.start) == len(Pose._fields) else None
    if start is None or not all(abs(value) < START_MAX for value in start):
        raise PlanningError("", "has an unusable start pose", "give x (m), y (m) and heading (rad) on the field")
    return start


def _caps(sent: list[Sent], limits: Limits) -> list[Cap]:
    """The transit speed and the comfortable acceleration, less where the wheels need it."""
    return [Cap(s.end_m, *limits.on(s.curvature_1pm, s.sharpness_1pm2, limits.transit_speed_mps)) for s in sent]


def _steady(painted: list[Painted], limits: Limits, vehicle: Vehicle) -> list[Steady]:
    """The paint speed from where the valve is opened to where the line ends."""
    lead = vehicle.valve_on_delay_s * limits.paint_speed_mps
    return [Steady(p.start_m - lead, p.end_m, limits.paint_speed_mps) for p in painted]
