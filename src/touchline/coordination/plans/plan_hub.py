"""Plans for a team whose messages may be lost, late, doubled or out of order.

A robot follows a new plan only if that continues its own and comes in time (`onboard/executive/plan_keeper.py`). Until
it has reported which it follows, both are kept clear, and it gets no other: claim before use, release after.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.algorithms.algorithm_task import AlgorithmTask
from touchline.coordination.algorithms.team_algorithm import GoalWish, Wish
from touchline.coordination.free_area import FreeArea
from touchline.coordination.interventions import Interventions
from touchline.coordination.plans.barrier_plans import BarrierPlans
from touchline.coordination.plans.committed_plans import CommittedPlans
from touchline.coordination.plans.plan_kernels import PlanLimits, samples_of
from touchline.coordination.tasks import TeamTask
from touchline.core import timed_motion as t
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import Guidance, PlanState
from touchline.schemas.messages.team_messages import FIRST_CELL, NOTHING_HEARD_S

Floats = NDArray[np.float64]

_NEARLY_S: Final = 1e-6
_NUMBERS: Final = 1 << 20
"""Numbers of plans that a hub has for itself: a former one that goes on must not take those of another for its own."""


class OffPlan(TouchlineError):
    """Error: a robot is so far off its plan that what keeps others off it does not hold any more."""


@dataclass(frozen=True)
class PlanSettings:
    """Common settings of a team that drives by plans.

    Attributes:
        limits: Limits of plans.
        lag_s: Time constant of the robots' actuators: they are late by that on their plans, all alike.
        margin_m: Distance from its plan at which a robot is still within what plans keep clear.
        certain: Whether what is sent always arrives at once, and is followed.
        avoid: What keeps plans apart; none: nothing.
        resting_s: Time of silence after which a robot is at the end of its plan.
    """

    limits: PlanLimits
    lag_s: float
    margin_m: float
    certain: bool
    avoid: Literal["plans", "barriers", "none"]

    @property
    def resting_s(self) -> float:
        """Time of silence after which a robot has come to the end of every plan that it may follow."""
        return 2.0 * self.limits.brakes_at * t.STEP_S + self.limits.speed_max_mps / self.limits.acceleration_mps2


class FollowedPlan(NamedTuple):
    """State of a robot, and the plan that it follows: samples (m, 5) from `start_s` on, none where it stands."""

    state: PlanState
    samples: Floats
    start_s: float


@dataclass
class _Robot:
    """Knowledge of one robot.

    Attributes:
        newest: The message with its newest stamp.
        heard_s: Time of its arrival.
        sent: Its last guidance.
        followed: Guidance with the plan that it is known to follow.
    """

    newest: PlanState
    heard_s: float
    sent: Guidance
    followed: Guidance


class PlanHub:
    """Plans for a team, as `Hub` has cells; clocks of hub and robots are the same."""

    def __init__(
        self,
        area: FreeArea,
        task: TeamTask,
        starts: Mapping[str, PlanState | FollowedPlan],
        now_s: float,
        settings: PlanSettings,
    ) -> None:
        """Start with all robots at rest, or with the plans that they follow.

        Args:
            area: The area.
            task: The task.
            starts: State of each robot, by its name; with its plan if it has one.
            now_s: Hub's clock.
            settings: Common settings.

        Raises:
            TooNear: Two robots, or one and a wall, are nearer than plans may be.
        """
        self.settings = settings
        known = {name: _followed(starts[name]) for name in sorted(starts)}
        self._plans = _plans(np.array([_rest(each, now_s, settings) for each in known.values()]), area, settings)
        sent = {name: _sent(each) for name, each in known.items()}
        self._robots = {name: _Robot(each.state, now_s, sent[name], sent[name]) for name, each in known.items()}
        decided = max((each.state.decided for each in known.values()), default=FIRST_CELL)
        self._number = -(-decided // _NUMBERS) * _NUMBERS
        self._task, self._now_s = task, now_s
        self.goals: dict[str, tuple[float, float]] = {}
        self.interventions = Interventions()
        self._nearest_m = math.inf
        self._off_m = dict.fromkeys(known, 0.0)

    def set_task(self, task: TeamTask) -> None:
        """Continue with another task."""
        self._task, self.interventions = task, Interventions()

    def receive(self, name: str, message: PlanState, now_s: float) -> None:
        """Take a message, in any order.

        Args:
            name: The sender, a robot of the team.
            message: The message.
            now_s: Hub's clock.
        """
        robot, who = self._robots[name], list(self._robots).index(name)
        if message.stamp_s <= robot.newest.stamp_s:
            return
        robot.newest, robot.heard_s = message, now_s
        sent = robot.sent
        if not self._plans.proposed[who]:
            return
        if message.adopted == sent.number:
            self._plans.settle(who, follows=True)
            robot.followed = sent
        elif message.decided >= sent.number or message.stamp_s > sent.plan_branch_s + _NEARLY_S:
            self._plans.settle(who, follows=False)

    def update(self, now_s: float) -> None:
        """Choose new plans; to be called once per period.

        Args:
            now_s: Hub's clock.

        Raises:
            OffPlan: A robot is too far off its plan.
        """
        self._now_s = now_s
        self._look_for_strays()
        names = list(self._robots)
        before, open_before = self._plans.plans.copy(), self._plans.proposed
        self._plans.update(self._wishes(names), self._staying)
        self.interventions.note(names, self._plans.changes)
        self._nearest_m = self._plans.closest_m
        new = self._plans.proposed & ~open_before
        if self.settings.certain:
            new = (self._plans.plans != _later(before, self.settings.limits.update_steps)).any(axis=(1, 2))
        for who, name in enumerate(names):
            if new[who]:
                self._send(self._robots[name], self._plans.proposals[who])

    def guidance(self) -> dict[str, Guidance]:
        """Return the robots' guidance now, by name: repeated until there is something new."""
        return {
            name: robot.sent.model_copy(update={"echo_s": max(robot.newest.stamp_s, NOTHING_HEARD_S)})
            for name, robot in self._robots.items()
        }

    def _send(self, robot: _Robot, plan: Floats) -> None:
        self._number += 1
        limits, end = self.settings.limits, plan[-1]
        robot.sent = Guidance(
            number=self._number,
            echo_s=robot.newest.stamp_s,
            target_x_m=float(end[t.X]),
            target_y_m=float(end[t.Y]),
            plan=plan.ravel().copy(),
            plan_start_s=self._now_s,
            plan_branch_s=self._now_s + limits.lead_steps * t.STEP_S,
            plan_base=robot.followed.number,
        )
        if self.settings.certain:
            robot.followed = robot.sent

    def _wishes(self, names: Sequence[str]) -> list[Wish]:
        """Return the wish of each robot."""
        states = np.array(
            [
                (each.x_m, each.y_m, each.heading_rad, each.speed_mps)
                for each in (robot.newest for robot in self._robots.values())
            ]
        )
        if isinstance(self._task, AlgorithmTask):
            wishes = self._task.wishes(names, states)
            self.goals = {name: _goal(wish, state) for (name, wish), state in zip(wishes.items(), states, strict=True)}
            return [wishes[name] for name in names]
        goals = self._task.goals(names, states)
        self.goals = {name: (x, y) for name, (x, y) in zip(names, goals.tolist(), strict=True)}
        return [GoalWish(x, y) for x, y in goals.tolist()]

    @property
    def _staying(self) -> list[int]:
        """Robots that take no other plan, or follow for certain what they were sent and cannot be sent one now."""
        certain, now_s = self.settings.certain, self._now_s
        robots = enumerate(self._robots.values())
        return [who for who, robot in robots if robot.newest.stays or (certain and robot.heard_s < now_s)]

    def _look_for_strays(self) -> None:
        """Look how far robots are off their plans.

        Raises:
            OffPlan: One is too far off, or does not follow what it was sent for certain.
        """
        for name, robot in self._robots.items():
            self._off_m[name] = self._off_plan_m(robot)
        if self.settings.avoid == "none":
            return
        for name, off_m in self._off_m.items():
            state, followed = self._robots[name].newest, self._robots[name].followed
            if self.settings.certain and state.decided >= followed.number != state.adopted:
                raise OffPlan(f"robot {name} has refused its plan, as it is to stand; all are stopped")
            if off_m > self.settings.margin_m:
                raise OffPlan(f"robot {name} is {off_m:.3f} m off its plan; all are stopped")
            if self.settings.certain and self._has_missed(self._robots[name]):
                raise OffPlan(f"robot {name} has missed its plan, and follows an older one; all are stopped")

    @staticmethod
    def _has_missed(robot: _Robot) -> bool:
        """Return whether a robot reports that it does not follow its plan, although it should have it by then."""
        state, followed = robot.newest, robot.followed
        return state.adopted != followed.number and state.stamp_s > followed.plan_branch_s + _NEARLY_S

    def _off_plan_m(self, robot: _Robot) -> float:
        """Return how far a robot believes to be from where its plan is, once its actuators have caught up (m)."""
        state, followed, lag_s = robot.newest, robot.followed, self.settings.lag_s
        if followed.number == FIRST_CELL or state.adopted != followed.number:
            return 0.0
        planned = np.zeros(t.COLUMNS)
        t.motion_at(np.reshape(followed.plan, (-1, t.COLUMNS)), state.stamp_s - followed.plan_start_s, planned)
        way_m, turned_rad = state.speed_mps * lag_s, 0.5 * state.yaw_rate_radps * lag_s
        x_m = state.x_m + way_m * math.cos(state.heading_rad + turned_rad)
        y_m = state.y_m + way_m * math.sin(state.heading_rad + turned_rad)
        return math.hypot(x_m - planned[t.X], y_m - planned[t.Y])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all robots of the team, sorted."""
        return tuple(self._robots)

    @property
    def places(self) -> Floats:
        """(n, 2) last reported places of the robots, in the order of their names (m, map frame)."""
        return np.array([(robot.newest.x_m, robot.newest.y_m) for robot in self._robots.values()]).reshape(-1, 2)

    @property
    def corners(self) -> dict[str, Floats]:
        """(0, 2) corners of each robot's cell, by name: there are none."""
        return {name: np.zeros((0, 2)) for name in self._robots}

    @property
    def outside_m(self) -> dict[str, float]:
        """Distance of each robot from its plan, as reported (m)."""
        return self._off_m

    @property
    def nearest_m(self) -> float:
        """Smallest distance of two robots' plans at the last update; inf for a single robot (m)."""
        return self._nearest_m

    @property
    def stuck(self) -> frozenset[str]:
        """Robot that others make way for, as it has come no nearer to its goal for long."""
        return frozenset() if self._plans.token < 0 else frozenset((self.names[self._plans.token],))

    @property
    def resting(self) -> frozenset[str]:
        """Robots that have been silent for so long that they stand at the ends of their plans."""
        silent_s = self.settings.resting_s
        return frozenset(name for name, robot in self._robots.items() if self._now_s - robot.heard_s >= silent_s)

    def taken_by(self, place: Floats) -> str:
        """Return a silent robot that may rest so near to a place (2,) (m) that nobody may go there; "": none."""
        for name in self.resting:
            who = list(self._robots).index(name)
            ends = (self._plans.plans[who, -1], self._plans.proposals[who, -1])
            if any(math.hypot(*(end[:2] - place)) < self.settings.limits.apart_m for end in ends):
                return name
        return ""


def _plans(poses: Floats, area: FreeArea, settings: PlanSettings) -> CommittedPlans:
    """Return plans of robots from their poses (n, 3), or plans under way (n, m, 5), as of `CommittedPlans`.

    Raises:
        TooNear: Two robots, or one and a wall, are nearer than plans may be.
    """
    if settings.avoid == "barriers":
        return BarrierPlans(poses, area, settings.limits, certain=settings.certain)
    return CommittedPlans(poses, area, settings.limits, certain=settings.certain, apart=settings.avoid == "plans")


def _later(plans: Floats, steps: int) -> Floats:
    """Return what is left of plans (n, m, 5) after some steps."""
    return plans[:, np.minimum(np.arange(plans.shape[1]) + steps, plans.shape[1] - 1)]


def _goal(wish: Wish, state: Floats) -> tuple[float, float]:
    """Return the goal (m) that a wish has; without one the robot's place."""
    return (wish.x_m, wish.y_m) if isinstance(wish, GoalWish) else (float(state[0]), float(state[1]))


def _followed(start: PlanState | FollowedPlan) -> FollowedPlan:
    """Return a robot's plan; none of one that stands."""
    return start if isinstance(start, FollowedPlan) else FollowedPlan(start, np.zeros((0, t.COLUMNS)), 0.0)


def _rest(followed: FollowedPlan, now_s: float, settings: PlanSettings) -> Floats:
    """Return what is left of a robot's plan, (m, 5) of `plan_kernels`; a stay without one."""
    plan = np.zeros((samples_of(settings.limits), t.COLUMNS))
    state = followed.state
    plan[:, :3] = state.x_m, state.y_m, state.heading_rad
    for step in range(len(plan) if len(followed.samples) else 0):
        t.motion_at(followed.samples, now_s - followed.start_s + step * t.STEP_S, plan[step])
    return plan


def _sent(followed: FollowedPlan) -> Guidance:
    """Return the guidance that a robot follows: without a plan, to stay where it stands."""
    state, plan = followed.state, followed.samples
    stays = Guidance(echo_s=state.stamp_s, target_x_m=state.x_m, target_y_m=state.y_m)
    if not len(plan):
        return stays
    x, y = plan[-1, [t.X, t.Y]].tolist()
    update = {"number": state.adopted, "plan": plan.ravel(), "plan_start_s": followed.start_s}
    return stays.model_copy(update={**update, "target_x_m": x, "target_y_m": y})
