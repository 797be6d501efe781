"""Start of the path to a goal: one rule for the robot, which drives it, and for previews of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from touchline.schemas.messages.plan_messages import LeavingTrajectory, PlanOptions, PlanRequest, PoseGoal
from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.messages.turf_tank import Trajectory

KEEP_S: Final = 2.0
"""Wall-clock time for which the present path is kept while the new one is planned and sent."""
_NOT_WHILE: Final = {
    TraversalStatus.PAUSED: "paused; resume or abort it first",
    TraversalStatus.ESTOPPED: "emergency-stopped; reset it first",
}


def hindrance(state: int) -> str:
    """Return reason and remedy if a robot accepts no goals in this state of its traversal; "" if it does."""
    return _NOT_WHILE.get(state, "")


@dataclass(frozen=True)
class PathStart:
    """State of a robot that determines where a path from it begins.

    Attributes:
        state: State of its traversal, as in `TraversalStatus`.
        pose: (3,) estimated x (m), y (m) and heading (rad) in the map frame.
        trajectory: Trajectory that it drives, if any.
        arc_length_m: Arc length that it has reached on that.
        pace: Sim time per wall time.
    """

    state: int
    pose: Sequence[float]
    trajectory: Trajectory
    arc_length_m: float
    pace: float

    @property
    def under_way(self) -> bool:
        """True if the path begins on a path that is being driven, else at rest."""
        return self.state == TraversalStatus.RUNNING

    def request(
        self, goal: PoseGoal, options: PlanOptions, vehicle_json: str, request_id: str, ground_json: str = ""
    ) -> PlanRequest:
        """Make the request for the path to a goal: from where the robot stands, or leaving the path that it drives.

        Args:
            goal: Goal pose.
            options: Limits; without a start.
            vehicle_json: The robot's vehicle as text; "" is the planner's own.
            request_id: Id of the request.
            ground_json: Known ground as text; "": nothing is known.
        """
        leaving: tuple[LeavingTrajectory, ...] = ()
        if self.under_way:
            keep_s = KEEP_S * max(1.0, self.pace)
            leaving = (LeavingTrajectory(trajectory=self.trajectory, arc_length_m=self.arc_length_m, keep_s=keep_s),)
        else:
            options = PlanOptions.model_validate({**dict(options), "start": np.array(self.pose)})
        return PlanRequest(
            request_id=request_id,
            vehicle_json=vehicle_json,
            options=options,
            goal=(goal,),
            leaving=leaving,
            ground_json=ground_json,
        )
