"""A drive to a pose while the operator prepares it: where to, how, and the plan for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from touchline.schemas.messages.plan_messages import PlanReport, PoseGoal
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.plain_text import plain
from touchline.tui.job import PathView
from touchline.tui.robot import ShownPose

TURN_DEG = 5.0
"""By so much a key turns the heading."""
_SAME = 1e-6


@dataclass
class GoalDraft:
    """What one robot's next drive is to be.

    `goal` is None unless the operator aims. Whatever changes it makes the plan for it, `path`, and what the planner
    `said` of it void; an answer about an earlier goal is of no use.
    """

    goal: PoseGoal | None = None
    path: PathView | None = None
    said: str = ""
    """Of a plan what it has chosen, or why there is none or it was not taken."""
    request_id: str = ""
    """Of the plan that is under way or there, or of the goal on its way to the robot."""
    _manner: PoseGoal = field(default_factory=PoseGoal)
    """Method and law of the last goal."""

    def begin(self, x_m: float, y_m: float) -> None:
        """Aim, from this place on, by the method and law of the last goal."""
        self._set(self._manner.model_copy(update={"x_m": x_m, "y_m": y_m}))

    def leave(self) -> None:
        """Aim no longer."""
        if self.goal is not None:
            kept = {"method": self.goal.method, "law": self.goal.law}
            self._manner = PoseGoal().model_copy(update=kept)
        self._set(None)

    def place(self, x_m: float, y_m: float, heading_rad: float = math.nan) -> None:
        """Aim at a pose; heading NaN: any."""
        self._update(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    def move(self, right: int, up: int, step_m: float) -> None:
        """Move the goal by steps, to whole multiples of a step along the axis in which it moves."""
        if self.goal is not None:
            self._update(x_m=stepped(self.goal.x_m, right, step_m), y_m=stepped(self.goal.y_m, up, step_m))

    def turn(self, steps: int, seen_from: ShownPose | None) -> None:
        """Turn the heading, counter-clockwise for positive steps; a free one is first as the goal lies from a pose."""
        if self.goal is None:
            return
        degrees = math.degrees(self.goal.heading_rad)
        if math.isnan(degrees):
            here = seen_from or ShownPose(self.goal.x_m, self.goal.y_m, 0.0)
            bearing_rad = math.atan2(self.goal.y_m - here.y_m, self.goal.x_m - here.x_m)
            degrees = round(math.degrees(bearing_rad) / TURN_DEG) * TURN_DEG
        else:
            degrees = stepped(degrees, steps, TURN_DEG)
        self._update(heading_rad=math.radians(math.remainder(degrees, 360.0)))

    def free_heading(self) -> None:
        """Leave the heading to the planner."""
        self._update(heading_rad=math.nan)

    def choose(self, goal: PoseGoal) -> None:
        """Go there as this one says."""
        self._set(goal)

    def asked(self, request_id: str) -> None:
        """The planner has been asked."""
        self.request_id, self.path, self.said = request_id, None, ""

    def sent(self, request_id: str) -> None:
        """The goal is on its way to the robot."""
        self.request_id = request_id

    def planned(self, trajectory: Trajectory, report: PlanReport, said: str) -> None:
        """Take the plan. Raises ValueError when it makes no sense."""
        self.path, self.said = PathView.of(trajectory, None, report), plain(said)

    def refused(self, request_id: str, why: str) -> None:
        """There is no plan, or the robot does not take the goal: another preview is due."""
        if request_id == self.request_id:
            self.path, self.said = None, why

    def _update(self, **values: float) -> None:
        if self.goal is not None:
            self._set(self.goal.model_copy(update=values))

    def _set(self, goal: PoseGoal | None) -> None:
        self.goal, self.path, self.said, self.request_id = goal, None, "", ""


def stepped(value: float, steps: int, step: float) -> float:
    """The multiple of a step so many on from a value, which counts as the multiple before it; as it is for none."""
    if not steps:
        return value
    before = math.floor(value / step + _SAME) if steps > 0 else math.ceil(value / step - _SAME)
    return round((before + steps) * step, 9)
