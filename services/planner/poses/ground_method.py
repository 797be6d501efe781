"""Pose method over known ground: another method's path where the body has room, else a way round."""

from __future__ import annotations

from collections.abc import Sequence

from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround
from touchline.schemas.messages import WaySearch
from touchline.services.planner.free_space.convex_parts import Corner
from touchline.services.planner.free_space.ground_ways import EVERYWHERE, GroundWays, ways_over
from touchline.services.planner.free_space.rounded_legs import path_is_free, rounded
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.poses.curve_search import curve_way
from touchline.services.planner.poses.dubins_paths import with_heading
from touchline.services.planner.poses.g2_path import G2Path, paths_by_g2
from touchline.services.planner.poses.joined_ways import joining_paths
from touchline.services.planner.poses.pose_method import PoseMethod, PosePath, heading_note
from touchline.services.planner.poses.rest_to_rest import rest_to_rest_s
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.turns import ContinuousTurn


class GroundMethod:
    """Path of a pose method where that is free, else by straights and turns round what obstructs it."""

    def __init__(
        self,
        inner: PoseMethod,
        ground: KnownGround,
        outline: Sequence[Corner],
        margin_m: float,
        search: WaySearch = EVERYWHERE,
    ) -> None:
        """Take a method and the ground.

        Args:
            inner: Method in open ground.
            ground: Boundary and obstacles.
            outline: (n, 2) corners of the body, in its own frame (m).
            margin_m: Margin round the body; it is reduced where start or goal leave less.
            search: What is looked for.
        """
        self._search = search
        self._inner, self._ground, self._outline, self._margin_m = inner, ground, outline, margin_m

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`."""
        ways = self._ways(start, goal, traveller)
        offered = self._inner.between(start, goal, traveller)
        if path_is_free(offered.path, ways.body):
            return offered
        if not isinstance(self._inner, G2Path):
            raise PlanningError(
                "", "has a goal to which the path of its method is obstructed", "give the method g2, which goes round"
            )
        path = _round_obstacles(start, goal, traveller, ways)
        return PosePath(path, _heading_note(path, goal))

    def moving(self, start: CurveEnd, goal: PathPose, traveller: Traveller) -> list[PosePath]:
        """Free paths by method g2 from amid a drive to rest at a goal, the quickest first: direct, else round things.

        Those round things join the way from rest without a stop.
        """
        ways = self._ways(start.pose, goal, traveller)
        offers = [offer for offer in G2Path().moving(start, goal, traveller) if path_is_free(offer.path, ways.body)]
        if offers or not traveller.can_spin:
            return offers
        try:
            way = _round_obstacles(start.pose, goal, traveller, ways)
        except PlanningError:
            return []
        note = _heading_note(way, goal)
        return [PosePath(path, note) for path in joining_paths(start, way, traveller, ways.body)]

    def _ways(self, start: PathPose, goal: PathPose, traveller: Traveller) -> GroundWays:
        search = self._search.model_copy(update={"no_reversing": not traveller.can_reverse})
        return ways_over(self._ground, self._outline, self._margin_m, (start, goal), search)


def _heading_note(path: PiecePath, goal: PathPose) -> str:
    turned = goal.heading_rad != goal.heading_rad
    return heading_note(path.end.heading_rad, "that of the way round obstacles") if turned else ""


def _round_obstacles(start: PathPose, goal: PathPose, traveller: Traveller, ways: GroundWays) -> PiecePath:
    if traveller.can_spin:
        turns = [ContinuousTurn(*turn) for turn in reversed(traveller.turns)]
        offers = [rounded(ways.legs(start, goal), turns, ways.body)]
        roomy = ways.roomy_legs(start, goal)
        if roomy is not None:
            offers.append(rounded(roomy, turns, ways.body))
        return min(offers, key=lambda path: rest_to_rest_s(path.pieces, traveller))
    aimed, _ = with_heading(start, goal, traveller.limits.curvature_max_1pm)
    found = curve_way(start, aimed, traveller, ways.body, lambda a, b: paths_by_g2(a, b, traveller))
    if found is None:
        ways.refuse_unreachable(start, goal)
        raise PlanningError(
            "", "has a goal to which no way was found, though one may exist", "give a smaller margin, or another goal"
        )
    return found
