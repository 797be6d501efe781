"""Draft of a drive to a pose: goal, method, and plan."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from touchline.schemas.messages.plan_messages import PlanReport, PoseGoal
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.plain_text import plain
from touchline.tui.job import PathView
from touchline.tui.robot import ShownPose

TURN_DEG = 5.0
"""Step by which a key turns the heading."""
_SAME = 1e-6


@dataclass(frozen=True)
class PlanAsked:
    """Request for a plan.

    Attributes:
        request_id: Id of the request.
        at_s: Time of the request on the console's clock.
        under_way: Whether the plan begins amid a drive, so that it is valid for a moment only.
    """

    request_id: str = ""
    at_s: float = 0.0
    under_way: bool = False


@dataclass
class GoalDraft:
    """Draft of a robot's next drive.

    `goal` is None unless the operator aims. Any change of it voids the plan `path` and the planner's `message`; answers
    about an earlier goal are dropped.
    """

    goal: PoseGoal | None = None
    path: PathView | None = None
    message: str = ""
    """Choices of the plan, or why there is none or it was refused."""
    shown: PlanAsked = PlanAsked()
    """Request that `path` answers."""
    trouble: str = ""
    """Reason why `path` could not be updated."""
    asked: PlanAsked | None = None
    """Request to the planner that is under way."""
    asked_s: float = -math.inf
    """Time of the last request to the planner."""
    unseen: bool = False
    """True if the goal may be sent without a preview."""
    sent_id: str = ""
    """Request id of the goal while it is being sent to the robot."""
    _manner: PoseGoal = field(default_factory=PoseGoal)
    """Method and law of the last goal."""

    @property
    def ready(self) -> bool:
        """True if the goal may be sent."""
        return self.path is not None or self.unseen

    def begin(self, x_m: float, y_m: float) -> None:
        """Begin to aim at a position, with method and law of the last goal."""
        self._set(self._manner.model_copy(update={"x_m": x_m, "y_m": y_m}))

    def leave(self) -> None:
        """Stop aiming."""
        if self.goal is not None:
            kept = {"method": self.goal.method, "law": self.goal.law}
            self._manner = PoseGoal().model_copy(update=kept)
        self._set(None)

    def place(self, x_m: float, y_m: float, heading_rad: float = math.nan) -> None:
        """Set the goal's pose; heading NaN: any."""
        self._update(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    def move(self, right: int, up: int, step_m: float) -> None:
        """Move the goal by steps, to multiples of the step along the axis of the motion."""
        if self.goal is not None:
            self._update(x_m=stepped(self.goal.x_m, right, step_m), y_m=stepped(self.goal.y_m, up, step_m))

    def turn(self, steps: int, seen_from: ShownPose | None) -> None:
        """Turn the heading, counter-clockwise for positive steps; a free one starts as the bearing from a pose."""
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
        """Take method, law and duration from a goal."""
        self._set(goal)

    def ask(self, asked: PlanAsked) -> None:
        """Note a request to the planner."""
        self.drop("")
        self.ask_again(asked)

    def ask_again(self, asked: PlanAsked) -> None:
        """Note a request to the planner, while the present plan is still shown."""
        self.asked, self.asked_s = asked, asked.at_s

    def planned(self, trajectory: Trajectory, report: PlanReport, message: str) -> None:
        """Take the requested plan.

        Raises:
            ValueError: The plan is not valid.
        """
        self.path, self.message = PathView.of(trajectory, None, report), plain(message)
        self.shown, self.asked, self.trouble = self.asked or PlanAsked(), None, ""

    def not_planned(self, why: str) -> None:
        """Note that there is no plan; an earlier one is still shown."""
        self.asked = None
        if self.path is None:
            self.message = why
        else:
            self.trouble = why

    def send(self, request_id: str) -> None:
        """Note that the goal is being sent to the robot."""
        self.asked, self.sent_id = None, request_id

    def drop(self, why: str) -> None:
        """Drop the plan, as it is void or the robot refused the goal: another preview is due."""
        self.path, self.message, self.shown, self.trouble = None, why, PlanAsked(), ""
        self.asked, self.unseen, self.sent_id = None, False, ""

    def go_unseen(self, why: str) -> None:
        """Note that there can be no preview."""
        self.drop(why)
        self.unseen = True

    def _update(self, **values: float) -> None:
        if self.goal is not None:
            self._set(self.goal.model_copy(update=values))

    def _set(self, goal: PoseGoal | None) -> None:
        self.goal = goal
        self.drop("")


def stepped(value: float, steps: int, step: float) -> float:
    """Move a value by steps to a multiple of the step; unchanged for 0 steps."""
    if not steps:
        return value
    before = math.floor(value / step + _SAME) if steps > 0 else math.ceil(value / step - _SAME)
    return round((before + steps) * step, 9)
