"""Transition from one covered area to the next."""

import math
from dataclasses import dataclass, replace

import shapely

from touchline.core.robust_overlay import buffer, union
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_raster import CoverageRaster
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece, split_at_cusps
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.stroke_transition import TransitionFinder
from touchline.services.planner.coverage.swept_area import swept
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

# Without a boundary the machine may leave the areas by this many turning radii.
AROUND_RADII = 6.0
# Length (m) of the straight that stands for the start pose of the machine.
STUB_M = 1e-3
# Price of uncovered ends of strokes (s/m²): high, so that they are driven to their ends and back.
ENDS_S_PER_M2 = 100.0


@dataclass(frozen=True)
class CoveredArea:
    """An area, the route over it, and the transition from there to the next area."""

    name: str
    task: CoverageTask
    route: CoverageRoute
    transition: tuple[DrivePiece, ...] = ()


def linked(first: CoveredArea, last: CoveredArea, boundary: shapely.Polygon | None) -> list[CoveredArea]:
    """Link two areas by a transition.

    Where the machine cannot turn otherwise, it leaves the last stroke of the first route early, or joins the first
    stroke of the second one late.

    Args:
        first: Area that is covered first.
        last: Area that is covered next.
        boundary: Polygon that the body does not leave (m, map frame); None: free ground between the areas.

    Raises:
        PlanningError: There is no transition on which the body touches nothing, or a route has no straight.
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
    join = TransitionFinder(space, CoverageRaster(strokes, machine.width_m), ENDS_S_PER_M2, reversing=reversing).best(
        ending, beginning
    )
    if join is None:
        problem = f'has no path for the machine from the area "{first.name}" to the area "{last.name}"'
        raise PlanningError("", problem, "give it more room between them, or each area a template of its own")
    kept = [replace(first.route.pieces[-1], path=ending.part(0.0, join.leave_m))] if join.leave_m else []
    transition = [*split_at_cusps(DriveKind.TURN, f"{first.name} to {last.name}", join.path, worked=False)]
    if join.begin_m < join.arrive_m:
        back = beginning.part(join.arrive_m, join.begin_m)
        transition += split_at_cusps(DriveKind.TURN, f"{first.name} to {last.name}", back, worked=False)
    joined = replace(last.route.pieces[0], path=beginning.part(join.begin_m, beginning.length_m))
    route = replace(first.route, pieces=(*first.route.pieces[:-1], *kept))
    following = replace(last.route, pieces=(joined, *last.route.pieces[1:]))
    return [replace(first, route=route, transition=tuple(transition)), replace(last, route=following)]


def standing_machine(start: PathPose, task: CoverageTask) -> CoveredArea:
    """Represent a machine outside the area of a task as an area of its own, to be linked to the first one."""
    stub = DrivePiece(DriveKind.SETTING_OUT, "setting out", PiecePath(start, (Piece(STUB_M),)), worked=False)
    about = shapely.Point(start[:2]).buffer(task.machine.reach_m)
    return CoveredArea("its start", replace(task, boundary=about), CoverageRoute((stub,), shapely.Polygon()))


def _between_straights(first: CoveredArea, last: CoveredArea) -> tuple[CoverageRoute, CoverageRoute]:
    """Trim one route after its last straight, and the other before its first.

    In small areas a route may end with a turn to a stroke that turned out to be needless.

    Raises:
        PlanningError: A route has no straight.
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
    """Convert the straight that begins or ends a route to a side of a lap, from which the tail may slide."""
    return CoverStroke(DriveKind.LAP, piece.label, piece.path.start, piece.path.length_m, piece.direction)
