"""A goal that a robot drives to in every run of a sweep, and the figures of such a run."""

import math
from dataclasses import dataclass
from typing import Self

from touchline.jobs.goal.goal_simulation import GoalDrive, drive_to_goal, plan_from
from touchline.jobs.single.simulation import Products
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle


@dataclass(frozen=True)
class GoalJob:
    """A goal: everything but the scenario and the computer's configuration."""

    goal: PoseGoal
    vehicle: Vehicle
    options: PlanOptions

    @classmethod
    def prepare(cls, goal: PoseGoal, options: PlanOptions, vehicle: Vehicle, start: Pose2) -> Self:
        """The job, once there is a plan from `start`; each run plans from where its robot believes to be.

        Raises:
            PlanningError: There is none.
        """
        plan_from((start.x_m, start.y_m, start.heading_rad), goal, vehicle, options)
        return cls(goal, vehicle, options)

    def drive(self, scenario: Scenario, config: OnboardConfig) -> GoalDrive:
        """One run.

        Raises:
            PlanningError: There is no way from where the robot believes to be.
            CommandRefused: It does not find out where it stands.
        """
        setup = Setup(vehicle=self.vehicle, onboard=config, scenario=scenario)
        return drive_to_goal(setup, self.goal, self.options, Products())


def arrival_run_figures(done: GoalDrive) -> dict[str, float]:
    """How far off the goal the robot came to rest in truth; without the heading's error, 0 to π, if any will do."""
    turned_rad = abs(done.true.turned_rad(done.goal))
    return {
        "off_m": done.true.off_m(done.goal),
        **({} if math.isnan(turned_rad) else {"turned_rad": turned_rad}),
        "planned_time_s": done.plan.report.total_time_s,
    }
