"""Goal of every run of a sweep, and the figures of a run."""

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
    """Goal with everything except the scenario and the computer's configuration."""

    goal: PoseGoal
    vehicle: Vehicle
    options: PlanOptions

    @classmethod
    def prepare(cls, goal: PoseGoal, options: PlanOptions, vehicle: Vehicle, start: Pose2) -> Self:
        """Check that a plan from `start` exists; each run plans anew from where its robot believes to be.

        Raises:
            PlanningError: There is none.
        """
        plan_from((start.x_m, start.y_m, start.heading_rad), goal, vehicle, options)
        return cls(goal, vehicle, options)

    def drive(self, scenario: Scenario, config: OnboardConfig) -> GoalDrive:
        """Simulate one run.

        Raises:
            PlanningError: There is no path from where the robot believes to be.
            CommandRefused: The robot is not localized in time.
        """
        setup = Setup(vehicle=self.vehicle, onboard=config, scenario=scenario)
        return drive_to_goal(setup, self.goal, self.options, Products())


def arrival_run_figures(done: GoalDrive) -> dict[str, float]:
    """Return the true error at rest; without the heading error, 0 to π, if any heading will do."""
    turned_rad = abs(done.true.turned_rad(done.goal))
    return {
        "off_m": done.true.off_m(done.goal),
        **({} if math.isnan(turned_rad) else {"turned_rad": turned_rad}),
        "planned_time_s": done.plan.report.total_time_s,
    }
