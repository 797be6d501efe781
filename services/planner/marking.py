"""Route along the lines of a template and the swaths of its areas."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from touchline.schemas.errors import NothingReachedError, PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Progress
from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.collision.clear_lines import (
    ReachableLines,
    clear_modes,
    reachable_lines,
    with_room,
)
from touchline.services.planner.collision.kept_clearance import with_standing_clearance
from touchline.services.planner.collision.ways_round import WaysRound
from touchline.services.planner.coverage.area_method import CoverageMethod, area_method_name
from touchline.services.planner.coverage.area_swaths import painted_segments
from touchline.services.planner.coverage.guarded_coverage import guarded_area_method
from touchline.services.planner.coverage.swath_figures import swath_figures
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.given_pose import START, pose_of
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.route.itinerary import ItineraryBuilder
from touchline.services.planner.route.route import route
from touchline.services.planner.route.worked_route import WetCrossings, WorkedRoute
from touchline.services.planner.sequencing.unavoidable import unavoidable_crossings
from touchline.services.planner.sequencing.wet_paint import Wheels
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths
from touchline.services.planner.tour import (
    UnreachableError,
    arranged,
    crossing_cost_s,
    drying_s,
    ordering,
    refuse_too_many,
)
from touchline.services.planner.transitions.guarded_turns import guarded_transitions
from touchline.services.planner.transitions.method_choice import method_of
from touchline.services.planner.transitions.transitions import REVERSING, SPINNING, TransitionFamily

LEAVE_OUT, REFUSE = "leave-out", "refuse"
# Shares of a curve at which its ground is looked up.
SHARES = np.linspace(0.0, 1.0, 5)


def marked(task: PlanTask, progress: Progress, enough: Callable[[], bool]) -> WorkedRoute:
    """Plan the route along the lines of a template and the swaths of its areas.

    Args:
        task: Template, vehicle and options.
        progress: Called with the stage and the fraction of it that is done.
        enough: Returns whether to take the best order so far.

    Raises:
        PlanningError: An option, a segment or an area cannot be met.
    """
    template, vehicle, options = task.template, task.vehicle, task.options
    segments = template.segments
    if template.areas:
        if vehicle.tool.width_m <= 0.0:
            problem = f'has the area "{template.areas[0].id}", and {vehicle.name} has no tool to cover it with'
            raise PlanningError("", problem, "use a vehicle with a sprayer or a roller")
        method = guarded_area_method(options, vehicle.tool)
        assert not isinstance(method, CoverageMethod), "coverage methods make routes, not swaths"
        segments = painted_segments(template, vehicle.tool.width_m, method)
    refuse_too_many(len(segments))
    if leaves_out(options):
        return _reachable(task, _clear_of_outlines(segments, task), progress, enough)[0]
    return _along(segments, task, _driver(task), progress, enough)


def leaves_out(options: PlanOptions) -> bool:
    """True if obstructed stretches of lines are left out, false if they are refused.

    Raises:
        PlanningError: The options ask for something else.
    """
    if options.obstructed not in ("", LEAVE_OUT, REFUSE):
        problem = f'asks for the unknown treatment "{options.obstructed}" of obstructed lines'
        raise PlanningError("", problem, f"use {LEAVE_OUT} or {REFUSE}")
    return options.obstructed != REFUSE


def lines_reached(task: PlanTask, progress: Progress) -> ReachableLines:
    """Find the parts of a template's lines that one robot reaches; all of them if there are no outlines.

    Raises:
        PlanningError: As `marked`.
    """
    lines = _clear_of_outlines(task.template.segments, task)
    return _reachable(task, lines, progress, lambda: False)[1] if lines.left_out else lines


def _reachable(
    task: PlanTask, lines: ReachableLines, progress: Progress, enough: Callable[[], bool]
) -> tuple[WorkedRoute, ReachableLines]:
    """Plan the route along reachable parts; parts that prove unreachable are shortened, and finally left out."""
    driver = _driver(task)
    while lines.segments:
        try:
            route = _along(lines.segments, task, driver, progress, enough)
        except UnreachableError as error:
            lines = lines.shortened(error.parts, error.segment_id)
        else:
            return replace(route, left_out=lines.left_out), lines
    raise nothing_reached(lines)


def nothing_reached(lines: ReachableLines) -> NothingReachedError:
    """Create the error for a template without a line that can be painted."""
    outlines = ", ".join(f'"{name}"' for name in dict.fromkeys(each.outline for each in lines.left_out))
    problem = f"has no line that can be painted: everywhere the robot's body would touch {outlines}"
    return NothingReachedError("", problem, "move the lines or the outlines apart, or paint them by hand")


def _clear_of_outlines(segments: tuple[TemplateSegment, ...], task: PlanTask) -> ReachableLines:
    template = with_standing_clearance(task.template, task.vehicle, task.options)
    return reachable_lines(segments, template, task.vehicle, task.limits, turned=ordering(task.options))


def _driver(task: PlanTask) -> ItineraryBuilder:
    """Create the builder of itineraries, which keeps what it finds for further routes of the same task.

    Raises:
        PlanningError: An option cannot be met, or the robot touches an outline at its start.
    """
    vehicle, options = task.vehicle, task.options
    template = with_standing_clearance(task.template, vehicle, options)
    start, checker = pose_of(START, options.start), CollisionChecker.of(template, vehicle)
    if start and checker and (hit := checker.collision(PiecePath(start, ()))):
        raise PlanningError("", f"begins where the robot's body touches {hit}", "drive it off there, or move that")
    transitions = transitions_of(vehicle, options, task.limits)
    ways = None
    if checker is not None and SPINNING in transitions.standing:
        ways = WaysRound(checker, _worked_places(template), transitions)
    return ItineraryBuilder(
        transitions,
        Painting.of(vehicle, task.limits, options),
        checker,
        Wheels.of(vehicle, template.line_width_m, drying_s(vehicle, options)),
        max(crossing_cost_s(options), task.company.crossing_s),
        start,
        _end(options),
        options.return_to_start,
        others=task.company.painted,
        ways=ways,
    )


def _worked_places(template: Template) -> list[tuple[float, float]]:
    """Places (m) on the ground of a template: along its lines, and round its areas."""
    curves = [segment.curve() for segment in template.segments]
    along = [np.column_stack(curve.at(SHARES * curve.length_m)[:2]) for curve in curves]
    return [(x, y) for places in (*along, *(area.outline for area in template.areas)) for x, y in np.array(places)]


def _along(
    segments: tuple[TemplateSegment, ...],
    task: PlanTask,
    driver: ItineraryBuilder,
    progress: Progress,
    enough: Callable[[], bool],
) -> WorkedRoute:
    """Plan the route along segments."""
    options, free = task.options, ordering(task.options)
    choices = [
        with_room(clear_modes(choice, driver.checker) if free else choice, driver.checker, task.limits)
        for choice in modes(segments, task.vehicle, task.limits.curvature_max_1pm, free=free)
    ]
    drive = arranged(swaths(choices, driver.painting, free=free), driver, options, progress, enough)
    unavoidable = unavoidable_crossings(drive.strokes, drive.over, choices, driver.wheels)
    sections = route(drive)
    named = area_method_name(options, task.vehicle.tool)
    figures = swath_figures(task, sections, named) if task.template.areas else ()
    return WorkedRoute(sections, WetCrossings(drive.wet_crossings, unavoidable), figures)


def transitions_of(vehicle: Vehicle, options: PlanOptions, limits: Limits) -> TransitionFamily:
    """Create the transitions of the method that the options name ("" is the default), within the vehicle's abilities.

    Raises:
        PlanningError: There is no such method.
    """
    able = {REVERSING: vehicle.drive.can_reverse, SPINNING: vehicle.drive.can_spin}
    standing = frozenset(skill for skill, can in able.items() if can and not options.forward_only)
    return replace(guarded_transitions(method_of(options), options.method, limits), standing=standing)


def _end(options: PlanOptions) -> PathPose | None:
    if options.return_to_start and len(options.end):
        raise PlanningError("", "has return_to_start and an end pose", "give one of them")
    return pose_of("end", options.end)
