"""Guidance of a team by committed plans, in lockstep in one process, over links that lose nothing."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import Final

import numpy as np

from touchline.coordination.algorithms.algorithm_task import AlgorithmTask, task_with_algorithm
from touchline.coordination.algorithms.team_algorithm import GoalWish, Wish
from touchline.coordination.body_contacts import body_radius_m
from touchline.coordination.free_area import FreeArea
from touchline.coordination.interventions import Interventions
from touchline.coordination.plans.committed_plans import CommittedPlans
from touchline.coordination.plans.plan_kernels import PlanLimits
from touchline.coordination.tasks import TeamTask, task_of
from touchline.core.timed_motion import STEP_S
from touchline.jobs.team.team_guide import BelievedApart, run_over
from touchline.jobs.team.team_robot import TeamRobot
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.team import TeamScenario

YAW_RATE_MAX_RADPS: Final = 2.0
"""Largest yaw rate of plans."""


def limits_of(team: TeamScenario) -> PlanLimits:
    """Return the limits of a team's plans.

    A turn may take twice the acceleration of driving on at the wheels: they can do more than plans of paths ask for.
    """
    drive = team.vehicle.drive
    return PlanLimits(
        speed_max_mps=drive.transit_speed_mps,
        acceleration_mps2=drive.max_acceleration_mps2,
        lateral_acceleration_mps2=drive.max_lateral_acceleration_mps2,
        yaw_rate_max_radps=min(drive.max_yaw_rate_radps, YAW_RATE_MAX_RADPS),
        yaw_acceleration_radps2=2.0 * drive.max_acceleration_mps2 / drive.spin_lever_m,
        apart_m=2.0 * team.radius_m,
        wall_m=team.radius_m,
        period_steps=round(team.update_s / STEP_S),
    )


class PlanGuide:
    """Guide of a team by committed plans."""

    def __init__(self, team: TeamScenario, area: FreeArea, robots: Mapping[str, TeamRobot]) -> None:
        """Start to guide all robots.

        Args:
            team: The team.
            area: The area.
            robots: By name.

        Raises:
            SpecError: Messages are to be lost or late, or robots to fail: plans do not allow for that yet.
            CommandRefused: A robot of this kind cannot be guided.
        """
        _check(team)
        self._robots, self._team, self._area = robots, team, area
        self._update_ticks = round(100 * team.update_s)
        self._margin_m = team.radius_m - body_radius_m(team.vehicle)
        self._task: TeamTask | None = None
        self._plans: CommittedPlans | None = None
        self._begun_tick = 0
        self.believed, self.interventions, self.problem = BelievedApart(), Interventions(), ""
        for robot in robots.values():
            robot.begin_guided()

    @property
    def step_ticks(self) -> int:
        """Ticks until the next exchange, as of `TeamGuide`."""
        return self._update_ticks

    @property
    def task(self) -> TeamTask | None:
        """The team's task, as of `TeamGuide`."""
        return self._task

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Return robots that are not localized, as of `TeamGuide`."""
        return tuple(name for name, robot in self._robots.items() if not robot.emulator.onboard.aligned)

    def _places(self) -> dict[str, tuple[float, float]]:
        """Return where each robot believes to be (m)."""
        estimates = {name: robot.emulator.onboard.estimate for name, robot in self._robots.items()}
        return {name: (float(each[0]), float(each[1])) for name, each in estimates.items()}

    def talk(self, tick: int, awake: Collection[str]) -> bool:
        """Let all robots choose new plans, as of `TeamGuide`.

        Raises:
            TooNear: Robots stand too near to each other or to a wall at the start.
        """
        if self._task is None:
            if self.waits_for:
                return False
            self._begin(tick)
        else:
            self._look_for_strays()
        if self._plans is None or self._task is None or self.problem:
            return True
        names = list(self._robots)
        self._plans.update(self._wishes(self._task, names))
        self.interventions.note(names, self._plans.changes)
        self.believed.nearest_plans_m = min(self.believed.nearest_plans_m, self._plans.closest_m)
        for robot, plan in zip(self._robots.values(), self._plans.plans, strict=True):
            robot.follow_plan(plan.copy())
        return True

    def _wishes(self, task: TeamTask, names: list[str]) -> list[Wish]:
        """Return the wish of each robot."""
        states = np.array([robot.emulator.onboard.estimate[:4] for robot in self._robots.values()])
        if not isinstance(task, AlgorithmTask):
            return [GoalWish(x, y) for x, y in task.goals(names, states).tolist()]
        wishes = task.wishes(names, states)
        return [wishes[name] for name in names]

    def _begin(self, tick: int) -> None:
        poses = np.array([robot.emulator.onboard.estimate[:3] for robot in self._robots.values()])
        given = task_of(self._team.task, self._area, self._places())
        self._task = given if self._team.algorithm is None else task_with_algorithm(self._team, self._area, given)
        apart = self._team.avoid == "plans"
        self._plans = CommittedPlans(poses, self._area, limits_of(self._team), apart=apart)
        self._begun_tick = tick

    def _look_for_strays(self) -> None:
        """Pause all robots if one is so far off its plan that r_s does not hold its body any more."""
        if self.problem:
            return
        for name, robot in self._robots.items():
            off_m = robot.emulator.onboard.off_plan_m
            self.believed.off_plan_m = max(self.believed.off_plan_m, off_m)
            if off_m > self._margin_m:
                self.problem = f"robot {name} is {off_m:.3f} m off its plan; all are stopped"
        if self.problem:
            for robot in self._robots.values():
                with suppress(CommandRefused):
                    robot.emulator.pause()

    def finished(self, tick: int) -> bool:
        """Return whether the run is over, as of `TeamGuide`."""
        return run_over(self._team, self._task, tick - self._begun_tick, self._places())

    def blockage(self, name: str) -> str:
        """Return why a robot does not arrive, as of `TeamGuide`."""
        return ""


def _check(team: TeamScenario) -> None:
    """Check that nothing is asked for that plans do not allow for yet.

    Raises:
        SpecError: Something is.
    """
    asked = {"links": not team.links.lossless, "faults": team.faults or team.world.faults, "frozen": team.frozen}
    for field, there in asked.items():
        if there:
            raise SpecError("team", field, "is not supported with avoid: plans", "leave it out, or use avoid: cells")
