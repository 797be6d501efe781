"""Ways round outlines by straights and turns on the spot, between standstills beside two painted curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Final

import numpy as np
import shapely

from touchline.core.robust_overlay import as_area
from touchline.services.planner.collision.checker import MARGIN_M, CollisionChecker
from touchline.services.planner.free_space.ground_ways import GroundWays
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.rounded_legs import rounded
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, arc_displacement, joined
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline.services.planner.transitions.transitions import REVERSING, Transition, TransitionFamily

OFF_M: Final = MARGIN_M + 0.002
"""Distance of the body from outlines: what the checker asks for, and the error of tight turns."""
ASIDE_M: Final = 0.25 * np.arange(1, 21)
"""Distances ahead and behind at which a robot that has no room to turn where it stands looks for it."""


class WaysRound:
    """Ways of a robot that turns on the spot, by a map of the ground that is made when it is first needed.

    Args:
        checker: Checker of the outlines.
        around: Points (m, map frame) that are on the ground in any case, if there is no boundary.
        transitions: Transitions of the method in use.
    """

    def __init__(
        self, checker: CollisionChecker, around: Sequence[tuple[float, float]], transitions: TransitionFamily
    ) -> None:
        self._checker, self._around, self._transitions = checker, around, transitions
        turns = sorted(transitions.turns, key=lambda each: -each.speed_mps)
        self._turns = [ContinuousTurn(each.curvature_1pm, each.sharpness_1pm2) for each in turns]

    @cached_property
    def _ways(self) -> GroundWays:
        checker = self._checker
        outlines = [
            as_area(shapely.make_valid(shapely.Polygon(checker.edges[checker.owner == number, :2])))
            for number in range(len(checker.names))
        ]
        boundary = outlines.pop(0) if checker.bounded else None
        ground = ObstructedGround.of(boundary, outlines, self._around)
        corners = [(x, y) for x, y in checker.body.tolist()]
        return GroundWays(ground, corners, OFF_M, backs=REVERSING in self._transitions.standing, thorough=False)

    def leaves(self, start: CurveEnd) -> bool:
        """Return whether there is room to stand straight behind a painted curve.

        Args:
            start: End of the curve.
        """
        return self._ways.body.stands_free(self._beside(start, 1))

    def knows(self, start: CurveEnd, goal: CurveEnd) -> bool:
        """Return whether there is room to stand behind the start and before the goal: else nothing is known.

        Args:
            start: End of the last painted curve.
            goal: Beginning of the next one.
        """
        return self.leaves(start) and self._ways.body.stands_free(self._beside(goal, -1))

    def between(self, start: CurveEnd, goal: CurveEnd) -> Transition | None:
        """Find a short way; None if the map has none.

        Args:
            start: End of the last painted curve.
            goal: Beginning of the next one.
        """
        ends = self._beside(start, 1), self._beside(goal, -1)
        if found := self._quickest(start, goal, *ends):
            return found
        aside = self._aside(ends[0]) if start.speed_mps == 0.0 else ()
        return next((way for leaving in aside if (way := self._quickest(start, goal, leaving, ends[1]))), None)

    def _quickest(self, start: CurveEnd, goal: CurveEnd, leaving: PathPose, reaching: PathPose) -> Transition | None:
        """Find the quicker way with and without room at corners; the first standstill is straight ahead or behind."""
        ways = self._ways
        out, into = (Piece(self._room_m(end), end.curvature_1pm) for end in (start, goal))
        aside = _straight(self._beside(start, 1), leaving)
        speeds = [self._transitions.speed_mps(end) for end in (start, goal)]
        found = list[Transition]()
        for legs in (ways.coarse_legs(leaving, reaching), ways.roomy_legs(leaving, reaching)):
            if legs is not None:
                driven = rounded(legs, self._turns, ways.body).pieces
                pieces = joined((out, aside, *driven, into))
                found.append(Transition(self._transitions.seconds(pieces, *speeds), PiecePath(start.pose, pieces)))
        return min(found, key=lambda each: each.seconds, default=None)

    def _aside(self, pose: PathPose) -> Iterator[PathPose]:
        """Nearest standstills with room to turn straight ahead of one without and behind it, if the body gets there."""
        body = self._ways.body
        for sense in () if self._turns_round(pose) else body.senses:
            for by_m in (sense * ASIDE_M).tolist():
                moved = pose.moved(complex(by_m), 0.0)
                if not body.sweeps(np.array((pose, moved)), 0.0):
                    break
                if self._turns_round(moved):
                    yield moved
                    break

    def _turns_round(self, pose: PathPose) -> bool:
        """Return whether the body has room to turn all round at a pose."""
        body = self._ways.body
        return bool(body.off_walls(np.array((pose[:2],)), 2.0 * body.reach_m)[0] > body.reach_m)

    def _beside(self, end: CurveEnd, ahead: int) -> PathPose:
        """Standstill on an extension of a curve."""
        room_m = ahead * self._room_m(end)
        return end.pose.moved(arc_displacement(room_m, end.curvature_1pm), room_m * end.curvature_1pm)

    def _room_m(self, end: CurveEnd) -> float:
        return self._transitions.room_m((self._transitions.speed_mps(end),))


def _straight(begin: PathPose, end: PathPose) -> Piece:
    """Straight from one pose to another ahead of it or behind it."""
    by_m = end.seen_from(begin)[0].real
    return Piece(abs(by_m), direction=1 if by_m >= 0.0 else -1)
