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


@dataclass(frozen=True)
class PlanAsked:
    """A plan that was asked for.

    Attributes:
        request_id: Of the request.
        at_s: When, by the console's own time.
        under_way: Whether it begins amid a drive, so that it holds for a moment only.
    """

    request_id: str = ""
    at_s: float = 0.0
    under_way: bool = False


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
    shown: PlanAsked = PlanAsked()
    """What `path` answers."""
    trouble: str = ""
    """Why `path` could not be planned anew since."""
    asked: PlanAsked | None = None
    """The question to the planner that is under way."""
    asked_s: float = -math.inf
    """When the planner was asked last."""
    unseen: bool = False
    """Whether it may be sent without a plan to look at."""
    sent_id: str = ""
    """Request id of the goal while it is on its way to the robot."""
    _manner: PoseGoal = field(default_factory=PoseGoal)
    """Method and law of the last goal."""

    @property
    def ready(self) -> bool:
        """Whether it may be sent next."""
        return self.path is not None or self.unseen

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

    def ask(self, asked: PlanAsked) -> None:
        """The planner is asked."""
        self.drop("")
        self.ask_again(asked)

    def ask_again(self, asked: PlanAsked) -> None:
        """The planner is asked, while the plan that is there is still shown."""
        self.asked, self.asked_s = asked, asked.at_s

    def planned(self, trajectory: Trajectory, report: PlanReport, said: str) -> None:
        """Take the plan that was asked for. Raises ValueError when it makes no sense."""
        self.path, self.said = PathView.of(trajectory, None, report), plain(said)
        self.shown, self.asked, self.trouble = self.asked or PlanAsked(), None, ""

    def not_planned(self, why: str) -> None:
        """There is no plan; one that was there before is shown on."""
        self.asked = None
        if self.path is None:
            self.said = why
        else:
            self.trouble = why

    def send(self, request_id: str) -> None:
        """The goal is on its way to the robot."""
        self.asked, self.sent_id = None, request_id

    def drop(self, why: str) -> None:
        """The plan holds no longer, or the robot does not take the goal: another preview is due."""
        self.path, self.said, self.shown, self.trouble = None, why, PlanAsked(), ""
        self.asked, self.unseen, self.sent_id = None, False, ""

    def go_unseen(self, why: str) -> None:
        """There can be no plan to look at."""
        self.drop(why)
        self.unseen = True

    def _update(self, **values: float) -> None:
        if self.goal is not None:
            self._set(self.goal.model_copy(update=values))

    def _set(self, goal: PoseGoal | None) -> None:
        self.goal = goal
        self.drop("")


def stepped(value: float, steps: int, step: float) -> float:
    """The multiple of a step so many on from a value, which counts as the multiple before it; as it is for none."""
    if not steps:
        return value
    before = math.floor(value / step + _SAME) if steps > 0 else math.ceil(value / step - _SAME)
    return round((before + steps) * step, 9)
