"""The way from one covered area to the next."""

import math
from dataclasses import dataclass, replace

import shapely

from touchline.core.robust_overlay import buffer, union
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece, one_way
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.drum_sweep import swept
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.stroke_join import Joiner
from touchline.services.planner.coverage.stroke_map import StrokeMap
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

# Without a boundary the machine may go so many turning radii beyond the areas to get from one to the next.
AROUND_RADII = 6.0
# The straight (m) at which a machine that stands somewhere sets out.
HAIR_M = 1e-3
# What the ends of the strokes are worth (s/m²): rather to their ends and back than left early.
ENDS_S_PER_M2 = 100.0


@dataclass(frozen=True)
class CoveredArea:
    """An area, the route over it, and the way on from there to the next area."""

    name: str
    task: CoverageTask
    route: CoverageRoute
    way: tuple[DrivePiece, ...] = ()


def carried_over(first: CoveredArea, last: CoveredArea, boundary: shapely.Polygon | None) -> list[CoveredArea]:
    """Both, with the way from the first one to where the other begins.

    The stroke that ends the first route may be left early, and that which begins the other one joined late, where the
    machine cannot turn otherwise.

    Args:
        first: Is driven first.
        last: Is driven behind it.
        boundary: That the body does not leave; None: it is free between the areas.

    Raises:
        PlanningError: No way was found on which the body touches nothing, or a route has no straight.
    """
    until, onward = _between_straights(first, last)
    first, last = replace(first, route=until), replace(last, route=onward)
    ending, beginning = (_stroke(piece) for piece in (first.route.pieces[-1], last.route.pieces[0]))
    machine, task = first.task.machine, first.task
    if boundary is None:
        both = union([first.task.boundary, last.task.boundary])
        boundary = shapely.box(*buffer(both, AROUND_RADII / machine.curvature_max_1pm).bounds)
    space = FreeSpace(boundary, task.obstacles, machine, task.margin_m)
    strokes = swept([stroke.part(0.0, stroke.length_m) for stroke in (ending, beginning)], machine.width_m)
    reversing = machine.can_reverse and not task.forward_only
    join = Joiner(space, StrokeMap(strokes, machine.width_m), ENDS_S_PER_M2, reversing=reversing).best(
        ending, beginning
    )
    if join is None:
        problem = f'has no way for the machine from the area "{first.name}" to the area "{last.name}"'
        raise PlanningError("", problem, "give it more room between them, or each area a template of its own")
    left = [replace(first.route.pieces[-1], path=ending.part(0.0, join.leave_m))] if join.leave_m else []
    way = [*one_way(DriveKind.TURN, f"{first.name} to {last.name}", join.way, worked=False)]
    if join.begin_m < join.arrive_m:
        back = beginning.part(join.arrive_m, join.begin_m)
        way += one_way(DriveKind.TURN, f"{first.name} to {last.name}", back, worked=False)
    joined = replace(last.route.pieces[0], path=beginning.part(join.begin_m, beginning.length_m))
    route = replace(first.route, pieces=(*first.route.pieces[:-1], *left))
    following = replace(last.route, pieces=(joined, *last.route.pieces[1:]))
    return [replace(first, route=route, way=tuple(way)), replace(last, route=following)]


def standing(start: PathPose, task: CoverageTask) -> CoveredArea:
    """Where a machine stands outside of the area of a task, to be carried over to that."""
    stub = DrivePiece(DriveKind.SETTING_OUT, "setting out", PiecePath(start, (Piece(HAIR_M),)), worked=False)
    about = shapely.Point(start[:2]).buffer(task.machine.reach_m)
    return CoveredArea("its start", replace(task, boundary=about), CoverageRoute((stub,), shapely.Polygon()))


def _between_straights(first: CoveredArea, last: CoveredArea) -> tuple[CoverageRoute, CoverageRoute]:
    """The routes up to the last straight of one, and from the first straight of the other on.

    In small areas a route may end with a turn, behind which a stroke turned out not to be needed.

    Raises:
        PlanningError: One has no straight at all.
    """
    ends = [k for k, piece in enumerate(first.route.pieces, start=1) if _is_straight(piece)]
    begins = [k for k, piece in enumerate(last.route.pieces) if _is_straight(piece)]
    if not ends or not begins:
        name = last.name if ends else first.name
        raise PlanningError("", f'has the area "{name}", in which nothing is driven straight', "make it larger")
    ending, beginning = first.route.pieces[: ends[-1]], last.route.pieces[begins[0] :]
    return replace(first.route, pieces=ending), replace(last.route, pieces=beginning)


def _is_straight(piece: DrivePiece) -> bool:
    across_m = math.dist(piece.path.start[:2], piece.path.end[:2])
    return abs(across_m - piece.path.length_m) < 1e-6


def _stroke(piece: DrivePiece) -> CoverStroke:
    """The straight piece that begins or ends a route; as a side of a lap, from which the tail may slide."""
    return CoverStroke(DriveKind.LAP, piece.label, piece.path.start, piece.path.length_m, piece.direction)
