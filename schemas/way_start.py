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
"""Wall clock: for so long the drive under way is kept, while the new way is planned and sent."""
_NOT_WHILE: Final = {
    TraversalStatus.PAUSED: "paused; resume or abort it first",
    TraversalStatus.ESTOPPED: "emergency-stopped; reset it first",
}


def hindrance(state: int) -> str:
    """Reason and remedy if a robot takes no goals in this state of its traversal; "" if it does."""
    return _NOT_WHILE.get(state, "")


@dataclass(frozen=True)
class WayStart:
    """A robot as far as a way from it is concerned.

    Attributes:
        state: Of its traversal, as in `TraversalStatus`.
        pose: (3,) x (m), y (m) and heading (rad) in the map frame, as it believes.
        trajectory: That it drives, if it does.
        arc_length_m: To which it has come on that.
        pace: Sim time per wall time.
    """

    state: int
    pose: Sequence[float]
    trajectory: Trajectory
    arc_length_m: float
    pace: float

    @property
    def under_way(self) -> bool:
        """Whether the way begins amid a drive, else at rest."""
        return self.state == TraversalStatus.RUNNING

    def request(self, goal: PoseGoal, options: PlanOptions, vehicle_json: str, request_id: str) -> PlanRequest:
        """The request for the way to a goal: from where the robot stands, or leaving the drive that it is on.

        Args:
            goal: Where to.
            options: Limits; without a start.
            vehicle_json: The robot's vehicle as text; "" is the planner's own.
            request_id: Of the request.
        """
        leaving: tuple[LeavingTrajectory, ...] = ()
        if self.under_way:
            keep_s = KEEP_S * max(1.0, self.pace)
            leaving = (LeavingTrajectory(trajectory=self.trajectory, arc_length_m=self.arc_length_m, keep_s=keep_s),)
        else:
            options = PlanOptions.model_validate({**dict(options), "start": np.array(self.pose)})
        return PlanRequest(
            request_id=request_id, vehicle_json=vehicle_json, options=options, goal=(goal,), leaving=leaving
        )
