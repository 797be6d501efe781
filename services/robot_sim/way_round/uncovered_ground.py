"""Ground of a template's areas that a robot has not covered, by its own progress along one plan after another."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from touchline.core.ground_pieces import HAIR_M, pieces_within_reach, wide_parts, worthwhile_pieces
from touchline.core.missed_patches import SMALLEST_M2
from touchline.core.robust_overlay import as_area, difference, intersection, union, union_of_two
from touchline.core.tool_reach import free_ground
from touchline.onboard.interface import PaintBelief
from touchline.schemas.ground_piece import GroundPiece
from touchline.schemas.messages import LeftOutPatch, LeftOutStretch, PlanOptions, Trajectory
from touchline.schemas.template import Area, Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.accounting.planned_tool_path import planned_tool_path
from touchline.services.robot_sim.accounting.swept_ground import swept_ground
from touchline.services.robot_sim.accounting.travelled_path import travelled_path
from touchline.services.robot_sim.way_round.remains import PLAN, TOO_SMALL, Clearances, LeftOut, Rest

if TYPE_CHECKING:
    import shapely
    from shapely.geometry.base import BaseGeometry


ALL_ROUND: Final = Clearances(left_m=0.012, far_side_m=0.15)
"""Clearances of a robot that goes all round things, and can leave its place in any direction that brings it no nearer:
what is left free is more than the rounding of outlines."""


STRAIGHT_M: Final = 0.01
"""Outlines of patches are simplified to straights within this distance."""


class LeftOutGround(NamedTuple):
    """Ground that a plan leaves out, and the reason as in `Remains`."""

    area_id: str
    ground: BaseGeometry
    reason: str


def left_out_grounds(patches: Iterable[LeftOutPatch]) -> list[LeftOutGround]:
    """Return the ground of reported patches."""
    import shapely

    outlines = ((each, shapely.Polygon(np.column_stack((each.corners_x_m, each.corners_y_m)))) for each in patches)
    return [LeftOutGround(each.area_id, as_area(shape), each.outline) for each, shape in outlines]


def patches_of(
    notes: Sequence[LeftOutGround], area_id: str, ground: BaseGeometry
) -> Iterator[tuple[shapely.Polygon, str]]:
    """Yield the large patches of uncovered ground of an area, and the reason for which each was left out, if any.

    A connected part is one patch if a reason holds for most of it, and no other for a patch's size; else it is cut, as
    it is where it surrounds covered ground, since outlines have no holes. Strips without any reason lie where the robot
    was beside its path: they are too small, too.

    Args:
        notes: Ground left out.
        area_id: Id of the area.
        ground: The ground (m, map frame).
    """
    noted = {
        reason: union([each.ground for each in notes if (each.area_id, each.reason) == (area_id, reason)])
        for reason in dict.fromkeys(each.reason for each in notes if each.reason)
    }
    for part in large_parts(ground):
        shares = {reason: intersection(shape, part) for reason, shape in noted.items()}
        main = max(shares, key=lambda reason: float(shares[reason].area), default="")
        alone = all(reason == main or share.area <= SMALLEST_M2 for reason, share in shares.items())
        if main and alone and shares[main].area > 0.5 * part.area:
            yield from ((each, main) for each in _without_holes(part))
            continue
        rest: BaseGeometry = part
        for reason, share in shares.items():
            yield from ((each, reason) for each in _without_holes(intersection(rest, share)))
            rest = difference(rest, share)
        yield from ((each, TOO_SMALL if wide_parts(each, HAIR_M).is_empty else "") for each in _without_holes(rest))


def large_parts(ground: BaseGeometry) -> list[shapely.Polygon]:
    """Return the parts of uncovered ground that are large enough to be listed."""
    import shapely

    return [part for part in shapely.get_parts(as_area(ground)).tolist() if part.area > SMALLEST_M2]


def _without_holes(ground: BaseGeometry) -> Iterator[shapely.Polygon]:
    """Yield the large parts of uncovered ground, cut along the y axis through holes that are as large."""
    import shapely

    for part in large_parts(ground):
        holes = [hole for ring in part.interiors if (hole := shapely.Polygon(ring)).area > SMALLEST_M2]
        if not holes:
            yield part
            continue
        (west, south, east, north), x = part.bounds, holes[0].centroid.x
        for side in (shapely.box(west, south, x, north), shapely.box(x, south, east, north)):
            yield from _without_holes(intersection(part, side))


def corners_of(patch: shapely.Polygon) -> list[tuple[float, float]]:
    """Return the corners of a patch's outline, once round, simplified."""
    import shapely

    ring = shapely.simplify(patch, STRAIGHT_M).exterior.coords[:-1]
    return [(float(x), float(y)) for x, y in ring]


class UncoveredGround:
    """Uncovered ground of areas; see `Remains`.

    Args:
        template: The whole template, in the map frame.
        vehicle: Vehicle that covers it.
        options: Options of its plans.
        remaining: What is to be covered of the areas; none: all of them. The rest counts as covered.

    Attributes:
        covered: Covered ground, in areas and beside them (m, map frame).
        notes: Ground left out.
    """

    def __init__(
        self, template: Template, vehicle: Vehicle, options: PlanOptions, remaining: Sequence[GroundPiece] = ()
    ) -> None:
        import shapely

        self.template, self._vehicle, self._options = template, vehicle, options
        self.clearances = ALL_ROUND
        self.covered: BaseGeometry = shapely.Polygon()
        if remaining:
            whole = union([area.polygon for area in template.areas])
            self.covered = difference(whole, union([piece.polygon for piece in remaining]))
        self.notes: tuple[LeftOutGround, ...] = ()
        self._reasons_left: set[str] | None = None
        self._left_out: LeftOut | None = None

    @property
    def done(self) -> float:
        """See `Remains`."""
        return float(sum(intersection(self.covered, area.polygon).area for area in self.template.areas))

    @property
    def left_out(self) -> LeftOut:
        """See `Remains`."""
        if self._left_out is None:
            noted = {
                area.id: union([each.ground for each in self.notes if each.area_id == area.id])
                for area in self.template.areas
            }
            self._left_out = self._patches(noted)
        return self._left_out

    @property
    def undone(self) -> LeftOut:
        """See `Remains`."""
        return self._patches({area.id: area.polygon for area in self.template.areas})

    @property
    def reasons_left(self) -> set[str]:
        """See `Remains`."""
        if self._reasons_left is None:
            again = (each for each in self.notes if each.reason != TOO_SMALL)
            self._reasons_left = {each.reason for each in again if self._is_worthwhile(each.ground)}
        return self._reasons_left

    def enter(self, trajectory: Trajectory, painted: PaintBelief, reached_m: float) -> None:
        """See `Remains`."""
        self.covered = union_of_two(self.covered, self._swept(travelled_path(trajectory, reached_m)))
        self._changed()

    def note_plan(self, trajectory: Trajectory) -> None:
        """See `Remains`."""
        swept = self._swept(trajectory)
        self._add(LeftOutGround(area.id, difference(area.polygon, swept), PLAN) for area in self.template.areas)

    def rest(self, without: Collection[str], seen: Sequence[Polygon]) -> Rest | None:
        """See `Remains`; pieces out of reach beside what was seen are no part of it, unless all are."""
        import shapely

        done = union([self.covered, *(each.ground for each in self.notes if each.reason in without)])
        pieces, within = list[GroundPiece](), list[GroundPiece]()
        for area in self.template.areas:
            left = as_area(difference(area.polygon, done))
            wider = worthwhile_pieces(left, self._vehicle.tool.width_m, self._options.overlap_m)
            found = as_area(intersection(wider, area.polygon))
            pieces += [GroundPiece.of(area.id, part) for part in shapely.get_parts(found)]
            within += [
                GroundPiece.of(area.id, part) for part in shapely.get_parts(self._within_reach(found, area, seen))
            ]
        some = within or pieces
        return Rest(self.template, tuple(some)) if some else None

    def note(
        self, rest: Rest, seen: Sequence[Polygon], trajectory: Trajectory, stretches: Iterable[LeftOutStretch]
    ) -> None:
        """See `Remains`."""
        import shapely

        swept = self._swept(trajectory)
        for piece in rest.pieces:
            self.notes = tuple(
                each._replace(ground=difference(each.ground, piece.polygon)) if each.area_id == piece.area else each
                for each in self.notes
            )
        self._add(
            LeftOutGround(piece.area, part, self._reason_of(part, seen))
            for piece in rest.pieces
            for part in shapely.get_parts(as_area(difference(piece.polygon, swept)))
        )
        planned = union([piece.polygon for piece in rest.pieces])
        self._add([each for area in self.template.areas for each in self._beyond(area, planned, seen)])

    @property
    def unexplained(self) -> bool:
        """See `Remains`."""
        return any(not patch.outline for patch in self.undone.patches)

    def skip(self, trajectory: Trajectory, reached_m: float, place: tuple[float, float], reason: str) -> bool:
        """See `Remains`; nothing is skipped."""
        return False

    def retry(self) -> None:
        """See `Remains`; nothing is skipped."""

    def give_reason(self, reason: str) -> None:
        """See `Remains`."""
        noted = union([self.covered, *(each.ground for each in self.notes if each.reason)])
        self._add(LeftOutGround(area.id, difference(area.polygon, noted), reason) for area in self.template.areas)

    def leave_out(self, outlines: Collection[str], reason: str) -> None:
        """See `Remains`."""
        self.notes = tuple(each._replace(reason=reason) if each.reason in outlines else each for each in self.notes)
        self._changed()

    def _add(self, notes: Iterable[LeftOutGround]) -> None:
        """Add notes."""
        self.notes = (*self.notes, *notes)
        self._changed()

    def _changed(self) -> None:
        """Drop what was derived from covered ground and notes."""
        self._reasons_left = self._left_out = None

    def _patches(self, grounds: Mapping[str, BaseGeometry]) -> LeftOut:
        """Return the uncovered patches of ground, by area id."""
        found = list[LeftOutPatch]()
        for area_id, ground in grounds.items():
            for part, reason in patches_of(self.notes, area_id, difference(ground, self.covered)):
                x, y = zip(*corners_of(part), strict=True)
                found.append(
                    LeftOutPatch(
                        area_id=area_id,
                        outline=reason,
                        size_m2=float(part.area),
                        corners_x_m=np.array(x),
                        corners_y_m=np.array(y),
                    )
                )
        return LeftOut(patches=tuple(found))

    def _beyond(self, area: Area, planned: BaseGeometry, seen: Sequence[Polygon]) -> Iterator[LeftOutGround]:
        """Yield the undone ground of an area that is no part of a plan of the rest, where that has a reason.

        Args:
            area: The area.
            planned: Ground that the plan is to cover.
            seen: Outlines that it keeps off.
        """
        import shapely

        noted = [each.ground for each in self.notes if each.area_id == area.id and each.reason]
        undone = as_area(difference(area.polygon, union([self.covered, planned, *noted])))
        worthwhile = self._worthwhile(undone)
        for part in shapely.get_parts(worthwhile):
            if beside := self._beside(part, seen):
                yield LeftOutGround(area.id, part, beside)
        yield LeftOutGround(area.id, difference(undone, worthwhile), TOO_SMALL)

    def _swept(self, trajectory: Trajectory) -> BaseGeometry:
        """Return the ground that the tool passes over along a trajectory."""
        return swept_ground(planned_tool_path(trajectory, self._vehicle)).swept

    def _worthwhile(self, ground: BaseGeometry) -> BaseGeometry:
        """Return the pieces of uncovered ground that are worth their time."""
        return worthwhile_pieces(as_area(difference(ground, self.covered)), self._vehicle.tool.width_m)

    def _is_worthwhile(self, ground: BaseGeometry) -> bool:
        """Return whether a part of uncovered ground is worth its time."""
        return not self._worthwhile(ground).is_empty

    def _within_reach(self, ground: BaseGeometry, area: Area, seen: Sequence[Polygon]) -> shapely.MultiPolygon:
        """Return the pieces of ground of an area of which the tool can reach a worthwhile part."""
        import shapely

        boundary, body = self.template.boundary, self._vehicle.body.footprint_m
        holes = [hole for each in self.template.areas for hole in each.holes]
        kept_out = [*(each.corners for each in (*self.template.obstacles, *seen)), *holes]
        inside = shapely.Polygon(boundary.corners if boundary is not None else area.outline)
        free = free_ground(inside, [shapely.Polygon(each) for each in kept_out], self._options.margin_m)
        return pieces_within_reach(ground, free, body, self._vehicle.tool.point_m, self._vehicle.tool.width_m)

    def _reason_of(self, part: BaseGeometry, seen: Sequence[Polygon]) -> str:
        """Return the reason for which the plan of a rest leaves out a part of it; "" if none is known."""
        return self._beside(part, seen) or ("" if self._is_worthwhile(part) else TOO_SMALL)

    def _beside(self, part: BaseGeometry, seen: Sequence[Polygon]) -> str:
        """Return the id of the nearest outline within half the tool's width of a piece of ground; "" if none is."""
        import shapely

        near = [(float(part.distance(shapely.Polygon(each.corners))), each.id) for each in seen]
        off_m, name = min(near, default=(0.0, ""))
        return name if off_m <= 0.5 * self._vehicle.tool.width_m else ""
