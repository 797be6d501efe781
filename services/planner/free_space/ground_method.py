"""Pose method over known ground: another method's path where the body has room, else a way round."""

from __future__ import annotations

from collections.abc import Sequence

from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround
from touchline.services.planner.free_space.convex_parts import Corner
from touchline.services.planner.free_space.curve_search import curve_way
from touchline.services.planner.free_space.ground_ways import GroundWays, ways_over
from touchline.services.planner.free_space.rounded_legs import path_is_free, rounded
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.poses.dubins_paths import with_heading
from touchline.services.planner.poses.g2_path import G2Path, paths_by_g2
from touchline.services.planner.poses.pose_method import PoseMethod, PosePath, heading_note
from touchline.services.planner.poses.rest_to_rest import rest_to_rest_s
from touchline.services.planner.poses.traveller import TURN_SHARES, Traveller
from touchline.services.planner.steering.turns import ContinuousTurn


class GroundMethod:
    """Path of a pose method where that is free, else by straights and turns round what obstructs it."""

    def __init__(self, inner: PoseMethod, ground: KnownGround, outline: Sequence[Corner], margin_m: float) -> None:
        """Take a method and the ground.

        Args:
            inner: Method in open ground.
            ground: Boundary and obstacles.
            outline: (n, 2) corners of the body, in its own frame (m).
            margin_m: Margin round the body; it is reduced where start or goal leave less.
        """
        self._inner, self._ground, self._outline, self._margin_m = inner, ground, outline, margin_m

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`."""
        ways = ways_over(self._ground, self._outline, self._margin_m, (start, goal))
        offered = self._inner.between(start, goal, traveller)
        if path_is_free(offered.path, ways.body):
            return offered
        if not isinstance(self._inner, G2Path):
            raise PlanningError(
                "", "has a goal to which the path of its method is obstructed", "give the method g2, which goes round"
            )
        path = _round_obstacles(start, goal, traveller, ways)
        turned = goal.heading_rad != goal.heading_rad
        note = heading_note(path.end.heading_rad, "that of the way round obstacles") if turned else ""
        return PosePath(path, note)

    def free(self, offers: Sequence[PosePath], start: PathPose, goal: PathPose) -> list[PosePath]:
        """Those of some paths from a start to a goal that the body can drive."""
        body = ways_over(self._ground, self._outline, self._margin_m, (start, goal)).body
        return [offer for offer in offers if path_is_free(offer.path, body)]


def _round_obstacles(start: PathPose, goal: PathPose, traveller: Traveller, ways: GroundWays) -> PiecePath:
    limits = traveller.limits
    if traveller.can_spin and traveller.can_reverse:
        speeds = (share * limits.transit_speed_mps for share in sorted(TURN_SHARES, reverse=True))
        turns = [ContinuousTurn(*turn) for turn in map(limits.turn_at, speeds) if turn[0] > 0.0]
        offers = [rounded(ways.legs(start, goal), turns, ways.body)]
        roomy = ways.roomy_legs(start, goal)
        if roomy is not None:
            offers.append(rounded(roomy, turns, ways.body))
        return min(offers, key=lambda path: rest_to_rest_s(path.pieces, traveller))
    aimed, _ = with_heading(start, goal, limits.curvature_max_1pm)
    found = curve_way(start, aimed, traveller, ways.body, lambda a, b: paths_by_g2(a, b, traveller))
    if found is None:
        ways.refuse_unreachable(start, goal)
        raise PlanningError(
            "", "has a goal to which no way was found, though one may exist", "give a smaller margin, or another goal"
        )
    return found
