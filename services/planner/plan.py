"""Plan a template: the whole algorithm, line by line."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PlanReport, Trajectory
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Progress
from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.coverage.area_method import area_method_of
from touchline.services.planner.coverage.area_swaths import painted_segments
from touchline.services.planner.geometry.clothoid import Floats, PathPose
from touchline.services.planner.limits import Limits
from touchline.services.planner.method_choice import method_of
from touchline.services.planner.output.measure import WetCrossings, measure
from touchline.services.planner.output.message import trajectory_message
from touchline.services.planner.route.itinerary import ItineraryBuilder
from touchline.services.planner.route.route import route
from touchline.services.planner.segments.section import Section
from touchline.services.planner.segments.sent_segments import Sent, send
from touchline.services.planner.sequencing.unavoidable import unavoidable_crossings
from touchline.services.planner.sequencing.wet import Wheels
from touchline.services.planner.speed.actuation import PaintedStretch, actuation_profile
from touchline.services.planner.speed.path_grid import course
from touchline.services.planner.speed.timing import SpeedProfile, Steady, speed_profile
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths
from touchline.services.planner.tour import arranged, crossing_cost_s, drying_s, ordering, refuse_too_many
from touchline.services.planner.transitions.transitions import REVERSING, SPINNING, TransitionFamily

# A pose further out than this (m) is a mistake.
POSE_MAX = 20_000.0


@dataclass(frozen=True)
class Plan:
    """A planned template.

    Attributes:
        trajectory: What is sent.
        report: Its figures.
        sections: The ideal curve.
        sent: The lines and arcs that stand for it.
        painted: The arc lengths of what is sent between which paint flows.
        speeds: Along what is sent.
        limits: That were kept.
    """

    trajectory: Trajectory
    report: PlanReport
    sections: list[Section]
    sent: list[Sent]
    painted: list[PaintedStretch]
    speeds: SpeedProfile
    limits: Limits


def plan(
    template: Template,
    vehicle: Vehicle,
    options: PlanOptions | None = None,
    progress: Progress = lambda stage, fraction: None,
    enough: Callable[[], bool] = lambda: False,
) -> Plan:
    """The trajectory that paints a template.

    The report's planning time is left at 0: the core knows no clock.

    Args:
        template: In the map frame.
        vehicle: That shall paint it.
        options: How to plan; by default the vehicle's own.
        progress: Told the stage and the fraction of it that is done; may raise, which ends planning.
        enough: Asked now and then whether to take the best order so far.

    Raises:
        PlanningError: An option, a segment or an area cannot be met; it names which and what to do.
    """
    options = options or PlanOptions()
    segments = painted_segments(template, vehicle.tool.width_m, area_method_of(options))
    refuse_too_many(len(segments))
    limits = Limits.of(vehicle, options)
    transitions, start, end = transitions_of(vehicle, options, limits), _pose("start", options.start), _end(options)
    wheels = Wheels.of(vehicle, template.line_width_m, drying_s(vehicle, options))
    painting = Painting.of(vehicle, limits, options)

    choices = modes(segments, vehicle, limits.curvature_max_1pm, free=ordering(options))
    driver = ItineraryBuilder(
        transitions,
        painting,
        CollisionChecker.of(template, vehicle),
        wheels,
        crossing_cost_s(options),
        start,
        end,
        options.return_to_start,
    )
    drive = arranged(swaths(choices, painting, free=ordering(options)), driver, options, progress, enough)
    sections = route(drive)
    sent = send(sections, lambda done: progress("cutting into arcs", done))

    painted = [PaintedStretch(s.id, s.start_m, s.end_m, s.stroke.actuation) for s in sent if s.stroke]
    steady = _steady(painted, [s.speed_mps for s in sections if s.stroke], vehicle)
    borders = [border for stretch in steady for border in stretch[:2]]
    speeds = speed_profile(course(sections, sent, borders, limits), steady, limits)
    progress("speeds", 1.0)

    switches = actuation_profile(painted, speeds, vehicle)
    trajectory = trajectory_message(sent, speeds, switches)
    unavoidable = unavoidable_crossings(drive.strokes, drive.over, choices, wheels)
    wet = WetCrossings(drive.wet_crossings, unavoidable)
    report = measure(trajectory, sections, sent, speeds, vehicle, wet)
    progress("report", 1.0)
    return Plan(trajectory, report, sections, sent, painted, speeds, limits)


def transitions_of(vehicle: Vehicle, options: PlanOptions, limits: Limits) -> TransitionFamily:
    """The transitions of the method that the options name, as far as the vehicle can drive them.

    Raises:
        PlanningError: There is no such method.
    """
    able = {REVERSING: vehicle.drive.can_reverse, SPINNING: vehicle.drive.can_spin}
    standing = frozenset(skill for skill, can in able.items() if can and not options.forward_only)
    return replace(method_of(options).transitions(limits), standing=standing)


def _pose(name: str, given: Floats) -> PathPose | None:
    if not len(given):
        return None
    pose = PathPose(*given.tolist()) if len(given) == len(PathPose._fields) else None
    if pose is None or not all(abs(value) < POSE_MAX for value in pose):
        raise PlanningError("", f"has an unusable {name} pose", "give x (m), y (m) and heading (rad) on the field")
    return pose


def _end(options: PlanOptions) -> PathPose | None:
    if options.return_to_start and len(options.end):
        raise PlanningError("", "shall end where it began and at another pose", "give one of both")
    return _pose("end", options.end)


def _steady(painted: list[PaintedStretch], speeds_mps: list[float], vehicle: Vehicle) -> list[Steady]:
    """The speed to hold along each line, from where the tool is commanded to begin to the line's end."""
    return [
        Steady(line.start_m - vehicle.tool.opens_s * speed, line.end_m, speed)
        for line, speed in zip(painted, speeds_mps, strict=True)
    ]
