"""Coverage figures of swaths, from the area that the tool sweeps along them."""

import math
from collections.abc import Sequence

import shapely

from touchline.core.missed_patches import patches
from touchline.core.robust_overlay import as_area, buffer, difference, intersection
from touchline.core.tool_reach import free_ground, reachable
from touchline.schemas.curves import Curve
from touchline.schemas.messages import MissedPatch, PlannedCoverage
from touchline.schemas.swath_ids import area_id_of, line_id_of
from touchline.schemas.template import Area
from touchline.services.planner.collision.checker import MARGIN_M
from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.coverage.swept_area import body_outside_m, swept, swept_twice
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.segments.section import Section

# Without a boundary the body may leave an area by this distance (m).
ROOM_M = 20.0


def swath_figures(task: PlanTask, sections: Sequence[Section], method: str) -> tuple[PlannedCoverage, ...]:
    """Compute the coverage figures of each area.

    A tool that works wherever it passes, and lies across the body's origin, covers on transitions, too.

    Args:
        task: Template, vehicle and options.
        sections: Sections of the route.
        method: Name of the area method.
    """
    return tuple(_of_area(area, task, sections, method) for area in task.template.areas)


def _of_area(area: Area, task: PlanTask, sections: Sequence[Section], method: str) -> PlannedCoverage:
    tool, machine = task.vehicle.tool, _machine(task)
    strokes = [each.stroke for each in sections if each.stroke and area.id in _area_ids(each.stroke.id)]
    paths = [_path_of(stroke.nozzle) for stroke in strokes]
    if tool.covers and tool.point_m == (0.0, 0.0):
        paths = [section.path for section in sections]
    wanted, covered = area.polygon, swept(paths, tool.width_m)
    obstacles = [shapely.Polygon(each.corners) for each in task.template.obstacles]
    boundary = task.template.boundary
    ground = shapely.Polygon(boundary.corners) if boundary else shapely.box(*buffer(wanted, ROOM_M).bounds)
    free = as_area(free_ground(ground, obstacles, MARGIN_M if boundary or obstacles else 0.0))
    within_reach = reachable(wanted, free, task.vehicle.body.footprint_m, tool.point_m, tool.width_m)
    covered_m2, reached_m2 = (float(intersection(covered, each).area) for each in (wanted, within_reach))
    return PlannedCoverage(
        method=method,
        area_m2=wanted.area,
        covered_m2=covered_m2,
        coverage_pct=100.0 * covered_m2 / wanted.area,
        reachable_m2=within_reach.area,
        reachable_pct=100.0 * reached_m2 / within_reach.area if within_reach.area else 100.0,
        overlap_m2=float(intersection(swept_twice(paths, tool.width_m), wanted).area),
        body_outside_m=body_outside_m(
            [section.path for section in sections], machine, as_area(free_ground(ground, obstacles))
        ),
        lanes=len(strokes),
        swath_angle_deg=math.degrees(strokes[0].nozzle.heading_rad) % 180.0 if strokes else 0.0,
        missed=tuple(MissedPatch(**patch._asdict()) for patch in patches(difference(wanted, covered))),
    )


def _area_ids(segment_id: str) -> tuple[str, str]:
    """Ids of the area to which a swath, or a part of one, may belong."""
    return area_id_of(segment_id), area_id_of(line_id_of(segment_id))


def _path_of(curve: Curve) -> PiecePath:
    return PiecePath(PathPose(curve.x_m, curve.y_m, curve.heading_rad), (Piece(curve.length_m, curve.curvature_1pm),))


def _machine(task: PlanTask) -> CoverageMachine:
    limits = task.limits
    return CoverageMachine(
        task.vehicle.tool.width_m,
        task.vehicle.body.footprint_m,
        limits.curvature_max_1pm,
        limits.sharpness_max_1pm2,
        limits.paint_speed_mps,
        limits.acceleration_mps2,
    )
