"""Route over the areas of a template, for a tool that works wherever it passes."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count, groupby

import shapely

from touchline.core.missed_patches import patches
from touchline.core.robust_overlay import as_area, difference, intersection
from touchline.core.tool_reach import free_ground
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import MissedPatch, PlannedCoverage
from touchline.schemas.template import Area
from touchline.services.planner.budget import Progress
from touchline.services.planner.coverage.area_method import CoverageMethod, area_method_name
from touchline.services.planner.coverage.between_areas import CoveredArea, linked, standing_machine
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.swept_area import body_outside_m, swept, swept_twice
from touchline.services.planner.geometry.clothoid import Piece, PiecePath
from touchline.services.planner.given_pose import START, pose_of
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import Section

# A shorter straight (m) belongs to a bend and is no swath.
SWATH_MIN_M = 0.5


def covered(task: PlanTask, method: CoverageMethod, progress: Progress) -> WorkedRoute:
    """Plan the route over the areas of a template, one after the other.

    Args:
        task: Template, vehicle and options.
        method: Coverage method.
        progress: Called with the stage and the fraction of it that is done.

    Raises:
        PlanningError: The template has lines, an area cannot be covered as asked, or two cannot be linked.
    """
    _refuse_lines(task)
    name = area_method_name(task.options, task.vehicle.tool)
    grounds, start = task.company.grounds, pose_of(START, task.options.start)
    areas = [area for area in task.template.areas if grounds is None or area.id in grounds]
    if start is not None:
        at = shapely.Point(start[:2])
        areas.sort(key=lambda area: float(at.distance(area.polygon)))
    boundary = shapely.Polygon(task.template.boundary.corners) if task.template.boundary else None
    parts: list[CoveredArea] = []
    for area in areas:
        asked = CoverageTask.of(task, area)
        if start is not None and not parts and asked.boundary.intersects(shapely.Point(start[:2])):
            asked = replace(asked, start=start)
        try:
            route = method.cover(asked, _share(progress, len(parts), len(areas)))
        except PlanningError as error:
            raise PlanningError("", f'{error.problem} (area "{area.id}")', error.remedy) from error
        parts.append(CoveredArea(area.id, asked, route))
    for k in range(len(parts) - 1):
        parts[k : k + 2] = linked(parts[k], parts[k + 1], boundary)
    sections: list[Section] = []
    if start is not None and parts and parts[0].task.start is None:
        outside, parts[0] = linked(standing_machine(start, parts[0].task), parts[0], boundary)
        sections += [section for piece in outside.transition for section in _sections(piece, areas[0], count(1))]
    for area, part in zip(areas, parts, strict=True):
        numbers = count(1)
        pieces = (*part.route.pieces, *part.transition)
        sections += [section for piece in pieces for section in _sections(piece, area, numbers)]
    return WorkedRoute(sections, coverage=tuple(_figures(part.route, part.task, name) for part in parts))


def _share(progress: Progress, number: int, of: int) -> Callable[[float], None]:
    """Progress of one area as a fraction of all."""
    return lambda done: progress("covering", (number + done) / of)


def _refuse_lines(task: PlanTask) -> None:
    if task.template.segments:
        problem = (
            f"has {len(task.template.segments)} lines beside its areas, and {task.vehicle.name} has nothing to mark"
            " with"
        )
        raise PlanningError("", problem, "leave the lines out, or use a vehicle with a sprayer")


def _sections(piece: DrivePiece, area: Area, numbers: Iterator[int]) -> Iterator[Section]:
    """Sections of a piece: its straights as swaths, if the tool works there, and the bends between them."""
    if any(part.spin_rad for part in piece.path.pieces):
        yield Section(piece.label, piece.path)
        return
    for straight, group in groupby(
        zip(piece.path.pieces, piece.path.knots, strict=False), lambda each: _straight(each[0])
    ):
        driven = list(group)
        path = PiecePath(driven[0][1], tuple(part for part, _ in driven))
        swath = piece.worked and straight
        if swath:
            path = PiecePath(path.start, (Piece(path.length_m, direction=piece.direction),))
        yield Section(piece.label, path, swath_id=area.swath_id(next(numbers)) if swath else "")


def _straight(part: Piece) -> bool:
    return part.curvature_1pm == part.sharpness_1pm2 == 0.0 and part.length_m >= SWATH_MIN_M


def _figures(route: CoverageRoute, asked: CoverageTask, method: str) -> PlannedCoverage:
    machine, paths = asked.machine, [piece.path for piece in route.pieces]
    rolled = swept(paths, machine.width_m)
    covered_m2, reached_m2 = (float(intersection(rolled, ground).area) for ground in (asked.wanted, route.reachable))
    lanes = [piece for piece in route.pieces if piece.kind is DriveKind.LANE]
    free = as_area(free_ground(asked.boundary, asked.obstacles))
    return PlannedCoverage(
        method=method,
        area_m2=asked.wanted.area,
        covered_m2=covered_m2,
        coverage_pct=100.0 * covered_m2 / asked.wanted.area,
        reachable_m2=route.reachable.area,
        reachable_pct=100.0 * reached_m2 / route.reachable.area if route.reachable.area else 100.0,
        overlap_m2=float(intersection(swept_twice(paths, machine.width_m), asked.wanted).area),
        body_outside_m=body_outside_m(paths, machine, free),
        lanes=len(lanes),
        laps=sum(piece.kind is DriveKind.LAP for piece in route.pieces),
        swath_angle_deg=math.degrees(lanes[0].path.start.heading_rad) % 180.0 if lanes else 0.0,
        notes=route.remarks,
        missed=tuple(MissedPatch(**patch._asdict()) for patch in patches(difference(asked.wanted, rolled))),
    )
