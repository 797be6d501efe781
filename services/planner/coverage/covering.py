"""Areas to be covered by a tool that works wherever it passes: from a template to the route over them."""

import math
from collections.abc import Iterator
from itertools import count, groupby

import shapely

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import MissedPatch, PlannedCoverage
from touchline.schemas.template import Area
from touchline.services.planner.budget import Progress
from touchline.services.planner.coverage.area_method import CoverageMethod, area_method_name
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.drum_sweep import clearance_m, swept, swept_m2
from touchline.services.planner.geometry.clothoid import Piece, PiecePath
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import Section

# A shorter straight (m) is part of a bend, no swath.
SWATH_MIN_M = 0.5
# Smaller patches (m²) that are missed are not named.
PATCH_MIN_M2 = 0.05


def covered(task: PlanTask, method: CoverageMethod, progress: Progress) -> WorkedRoute:
    """The route over the area of a template.

    Args:
        task: What is to be planned.
        method: That covers it.
        progress: Told the stage and the fraction of it that is done.

    Raises:
        PlanningError: The template has more than one area or lines, or an option or the area cannot be met.
    """
    area, name = _only_area(task), area_method_name(task.options, task.vehicle.tool)
    asked = CoverageTask.of(task, area)
    route = method.cover(asked, lambda done: progress("covering", done))
    numbers = count(1)
    sections = [section for piece in route.pieces for section in _sections(piece, area, numbers)]
    return WorkedRoute(sections, coverage=(_figures(route, asked, name),))


def _only_area(task: PlanTask) -> Area:
    template = task.template
    if template.segments:
        problem = (
            f"has {len(template.segments)} lines beside its areas, and {task.vehicle.name} has nothing to mark with"
        )
        raise PlanningError("", problem, "leave the lines out, or use a vehicle with a sprayer")
    if len(template.areas) > 1:
        problem = f"has {len(template.areas)} areas, which are covered one at a time"
        raise PlanningError("", problem, "give each a template of its own")
    return template.areas[0]


def _sections(piece: DrivePiece, area: Area, numbers: Iterator[int]) -> Iterator[Section]:
    """The straights of what is driven for the work along it as swaths, and the bends between them."""
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
    covered = rolled.intersection(asked.area)
    got = rolled.intersection(route.reachable).area
    missed = [patch for patch in shapely.get_parts(asked.area.difference(rolled)) if patch.area >= PATCH_MIN_M2]
    inside = [patch.representative_point() for patch in missed]
    lanes = [piece for piece in route.pieces if piece.kind is DriveKind.LANE]
    return PlannedCoverage(
        method=method,
        area_m2=asked.area.area,
        covered_m2=covered.area,
        coverage_pct=100.0 * covered.area / asked.area.area,
        reachable_m2=route.reachable.area,
        reachable_pct=100.0 * got / route.reachable.area if route.reachable.area else 100.0,
        overlap_m2=max(swept_m2(paths, machine.width_m) - rolled.area, 0.0),
        body_outside_m=-clearance_m(paths, machine, asked.boundary, asked.obstacles),
        lanes=len(lanes),
        laps=sum(piece.kind is DriveKind.LAP for piece in route.pieces),
        swath_angle_deg=math.degrees(lanes[0].path.start.heading_rad) % 180.0 if lanes else 0.0,
        notes=route.remarks,
        missed=tuple(
            MissedPatch(x_m=place.x, y_m=place.y, area_m2=patch.area)
            for place, patch in sorted(zip(inside, missed, strict=True), key=lambda each: -each[1].area)
        ),
    )
