"""Ways of a vehicle's body over known ground, and why there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Final

import shapely

from touchline.core.placed_outline import placed
from touchline.core.robust_overlay import as_area
from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround
from touchline.schemas.messages import WaySearch
from touchline.services.planner.free_space.convex_parts import Corner, body_parts
from touchline.services.planner.free_space.legs import Legs, WalledBody
from touchline.services.planner.free_space.narrowest import narrowest_place
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.reachability import Proof, Reachability
from touchline.services.planner.free_space.roadmap import Roadmap
from touchline.services.planner.free_space.slice_way import way_through_slices
from touchline.services.planner.free_space.slices import Slicer
from touchline.services.planner.free_space.tightening import tightened
from touchline.services.planner.geometry.clothoid import PathPose

MANOEUVRES_MAX: Final = 400
"""A way with more straights than this is not driven,"""
SEARCHED_MAX: Final = 2000
"""and one with more before it is shortened is not looked at."""
# Share of the distance of the body from a wall that becomes its margin by default, if the margin asked for is more.
SPARE_SHARE: Final = 0.5
# Factor by which a roadmap is finer that is looked at where the usual one has no way, or a detour:
FINER: Final = 2
# length of a way over the distance of the goal.
DETOUR: Final = 1.25
# Margin (m) beside the usual one that leaves room for turns at corners.
ROOM_M: Final = 0.25
# Grounds whose maps are kept.
GROUNDS_KEPT: Final = 8


EVERYWHERE: Final = WaySearch()


class GroundWays:
    """Ways of one body over one ground; its maps are made when they are needed, and kept.

    Attributes:
        margin_m: Margin round the body.
        body: The body with its margin among the walls.
    """

    def __init__(
        self,
        ground: ObstructedGround,
        outline: Sequence[Corner],
        margin_m: float,
        *,
        backs: bool = True,
        thorough: bool = True,
    ) -> None:
        """Take a ground and a body.

        Args:
            ground: The ground.
            outline: (n, 2) corners of the body, in its own frame (m).
            margin_m: Margin round the body.
            backs: True if the body may drive backward, if its vehicle can.
            thorough: True to look everywhere, and to prove that there is no way; False to look at roadmaps only.
        """
        self._thorough = thorough
        self.margin_m = margin_m
        self._ground, self._outline = ground, outline
        self._parts = body_parts(outline, margin_m)
        self.body = WalledBody.of(ground, self._parts, backs=backs)

    @cached_property
    def roadmap(self) -> Roadmap:
        """Roadmap of the ground."""
        return Roadmap(self.body)

    @cached_property
    def _finer_roadmap(self) -> Roadmap:
        return Roadmap(self.body, FINER)

    @cached_property
    def _reachability(self) -> Reachability:
        return Reachability(Slicer(self._ground, self._parts))

    def legs(self, start: PathPose, goal: PathPose) -> Legs:
        """Find a short way of straights and turns on the spot.

        Args:
            start: Start pose.
            goal: Goal pose; its heading may be NaN.

        Raises:
            PlanningError: There is none, or none was found; it says why.
        """
        found = self._by_roadmaps(start, goal)
        if found is None and not (self._thorough and self.body.backs):
            raise PlanningError("", "has a goal to which no way was found, though one may exist", "give another goal")
        if found is None:
            self.refuse_unreachable(start, goal)
            found = way_through_slices(self._reachability, start, goal, self.body, SEARCHED_MAX)
        legs = None if found is None else tightened(found, goal, self.body)
        if legs is None or legs.manoeuvres > MANOEUVRES_MAX:
            raise PlanningError(
                "",
                f"has a goal that takes more than {MANOEUVRES_MAX} manoeuvres in narrow places",
                f"give a margin below {self.margin_m:g} m, or another goal",
            )
        return legs

    def _by_roadmaps(self, start: PathPose, goal: PathPose) -> Legs | None:
        """Find a way on the usual roadmap, or a shorter one on the finer."""
        if not self._ground.joins((start.x_m, start.y_m), (goal.x_m, goal.y_m), self.body.disc_m):
            return None
        found = self.roadmap.way(start, goal)
        apart_m = math.hypot(goal.x_m - start.x_m, goal.y_m - start.y_m)
        if found is None or found.length_m > DETOUR * apart_m + self.body.reach_m:  # there may be one through a door
            ways = [way for way in (found, self._finer_roadmap.way(start, goal)) if way is not None]
            found = min(ways, key=lambda way: way.length_m, default=None)
        return found

    def coarse_legs(self, start: PathPose, goal: PathPose) -> Legs | None:
        """Find a short way on the usual roadmap; None if it has none."""
        found = self.roadmap.way(start, goal)
        return None if found is None else tightened(found, goal, self.body)

    def roomy_legs(self, start: PathPose, goal: PathPose) -> Legs | None:
        """Find a way with room for turns at corners; None if there is none by the roadmap, or no room at an end."""
        wider = self._wider
        ends = [pose for pose in (start, goal) if not math.isnan(pose.heading_rad)]
        if not all(wider.body.stands_free(pose) for pose in ends):
            return None
        return wider.coarse_legs(start, goal)

    @cached_property
    def _wider(self) -> GroundWays:
        margin_m = self.margin_m + ROOM_M
        return GroundWays(self._ground, self._outline, margin_m, backs=self.body.backs, thorough=self._thorough)

    def refuse_unreachable(self, start: PathPose, goal: PathPose) -> None:
        """Refuse a goal for which no way of the body is proved to exist, even of one that may reverse.

        Raises:
            PlanningError: It is proved that there is none, or nothing is proved; it says which.
        """
        proof = self._reachability.prove(start, goal)
        if proof is Proof.EXISTS:
            return
        beside = f" with {self.margin_m:g} m round it" if self.margin_m else ""
        if proof is Proof.UNDECIDED:
            raise PlanningError(
                "",
                f"has a goal so narrow to reach that it is undecided whether a way exists for the body{beside}",
                "give a smaller margin, or another goal",
            )
        place = narrowest_place(self._ground, self._outline, self.margin_m, start, goal)
        if place is None:
            raise PlanningError("", "has a goal that obstacles shut off on all sides", "give another goal")
        raise PlanningError(
            "",
            f"has a goal to which no way exists for the body{beside}: the narrowest place, near"
            f" ({place.x_m:.2f}, {place.y_m:.2f}), is {place.too_narrow_m:.3f} m too narrow",
            "widen it, give a smaller margin, or another goal",
        )


def ways_over(
    known: KnownGround,
    outline: Sequence[Corner],
    margin_m: float,
    ends: Sequence[PathPose],
    search: WaySearch,
) -> GroundWays:
    """Ways over known ground, with a margin that start and goal leave.

    Args:
        known: The ground.
        outline: (n, 2) corners of the body, in its own frame (m).
        margin_m: Margin round the body; it is reduced if an end is nearer to something.
        ends: Start and goal.
        search: What is looked for.

    Raises:
        PlanningError: The body touches something at an end.
    """
    share = search.spare_share or SPARE_SHARE
    around = () if known.boundary else tuple((pose.x_m, pose.y_m) for pose in ends)
    for pose, name in zip(ends, ("start", "goal"), strict=True):
        if not math.isnan(pose.heading_rad):
            margin_m = min(margin_m, share * _spare_m(known, around, tuple(outline), pose, name))
    return _ways(known, around, tuple(outline), margin_m, not search.no_reversing, not search.quick)


@lru_cache(GROUNDS_KEPT)
def _obstructed(known: KnownGround, around: tuple[Corner, ...]) -> ObstructedGround:
    obstacles = [as_area(shapely.make_valid(shapely.Polygon(each.corners, each.holes))) for each in known.obstacles]
    boundary = as_area(shapely.make_valid(shapely.Polygon(known.boundary))) if known.boundary else None
    return ObstructedGround.of(boundary, obstacles, around)


@lru_cache(GROUNDS_KEPT)
def _ways(
    known: KnownGround,
    around: tuple[Corner, ...],
    outline: tuple[Corner, ...],
    margin_m: float,
    backs: bool,
    thorough: bool,
) -> GroundWays:
    return GroundWays(_obstructed(known, around), outline, margin_m, backs=backs, thorough=thorough)


def _spare_m(
    known: KnownGround, around: tuple[Corner, ...], outline: tuple[Corner, ...], pose: PathPose, name: str
) -> float:
    """Distance of the body from the nearest wall at a pose (m).

    Raises:
        PlanningError: It touches something.
    """
    ground = _obstructed(known, around)
    body = placed(outline, pose)
    if ground.free.contains_properly(body):
        return float(body.distance(ground.free.boundary))
    touched = [each.id for each in known.obstacles if body.intersects(shapely.Polygon(each.corners, each.holes))]
    what = f'"{touched[0]}"' if touched else "the boundary"
    raise PlanningError(
        "", f"has a {name} at ({pose.x_m:.2f}, {pose.y_m:.2f}) where the body touches {what}", f"give another {name}"
    )
