"""`goto()`: a drive of an emulated robot to a pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from touchline.api.given_arguments import Progress, checked, no_progress, setup_of, vehicle_of
from touchline.jobs.goal.arrival import ReachedPose
from touchline.jobs.goal.goal_simulation import GoalDrive, drive_to_goal
from touchline.jobs.goal.known_field import load_ground
from touchline.jobs.single.simulation import Products
from touchline.schemas.given_angles import given_angle
from touchline.schemas.known_ground import OPEN_GROUND
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.vehicles import Vehicle


@dataclass(frozen=True, repr=False)
class GoalRun:
    """Finished drive to a pose.

    Attributes:
        goal: The goal.
        success: True if the robot came to rest within 5 cm and 2° of it.
        reason: Why not, or empty.
        duration_s: Time that it took.
        planned_s: Time that it should have taken.
        believed: Pose at rest by the robot's estimate: x_m, y_m, heading_rad.
        true: Pose at rest in truth.
        off_m: True distance from the goal.
        turned_rad: True error of the heading; NaN if any heading would do.
        hash: Hash of the session.
        notes: Remarks on the plan.
    """

    goal: PoseGoal
    success: bool
    reason: str
    duration_s: float
    planned_s: float
    believed: ReachedPose
    true: ReachedPose
    off_m: float
    turned_rad: float
    hash: str
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        """One line: goal, outcome, time and distance."""
        ended = "reached" if self.success else f"failed ({self.reason})"
        goal = f"({self.goal.x_m:g}, {self.goal.y_m:g})"
        return f"GoalRun({goal} {ended} in {self.duration_s:.1f} s, {self.off_m:.3f} m off)"


class _GoalOptions(BaseModel):
    """Keywords of `goto` that are the goal's own."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    method: str = ""
    law: str = ""
    duration_s: float = 0.0
    tangents_m: tuple[float, ...] = ()
    forward_only: bool = False
    field: str | Path | None = None
    margin_m: float = 0.05
    follower: str | None = None


def goto(
    goal: tuple[float, float] | tuple[float, float, float],
    /,
    *,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    vehicle: Vehicle | str | Path | None = None,
    scenario: Scenario | None = None,
    seed: int | None = None,
    record: str | Path | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> GoalRun:
    """Drive an emulated robot to a pose.

    Args:
        goal: x, y (m) and heading (rad), map frame; without a heading any will do.
        start: Pose at which it stands.
        vehicle: Robot, its name or its file; None: the line marker.
        scenario: Its world; None: undisturbed.
        seed: Seed of all noise; None: the scenario's.
        record: MCAP file to write.
        progress: Called with the fraction done and the present step.
        **options: method, law, duration_s, tangents_m, forward_only, field, margin_m and follower, as of
            `touchline goto`.

    Raises:
        SpecError: An argument cannot be used.
        PlanningError: There is no path.
        CommandRefused: The robot is not localized in time.
    """
    chosen = checked(_GoalOptions, options, "goto")
    heading = given_angle("goal", goal[2]) if len(goal) > 2 else math.nan
    aim = {"x_m": goal[0], "y_m": goal[1], "heading_rad": heading}
    own = chosen.model_dump(exclude={"forward_only", "field", "margin_m", "follower"})
    wanted = PoseGoal.model_validate({**aim, **own})
    pose = checked(Pose2, dict(zip(("x_m", "y_m", "heading_rad"), start, strict=True)), "start")
    setup = setup_of(vehicle_of(vehicle), scenario, None, seed, chosen.follower)
    there = setup.model_copy(update={"scenario": setup.scenario.model_copy(update={"start": pose})})
    products = Products(True, Path(record) if record is not None else None)
    planning = PlanOptions(forward_only=chosen.forward_only, margin_m=chosen.margin_m)
    ground = load_ground(chosen.field) if chosen.field is not None else OPEN_GROUND
    return _run(drive_to_goal(there, wanted, planning, products, progress or no_progress, ground))


def _run(done: GoalDrive) -> GoalRun:
    return GoalRun(
        done.goal,
        not done.problem,
        done.problem or done.outcome.reason,
        done.taken_s,
        done.plan.report.total_time_s,
        done.believed,
        done.true,
        done.true.off_m(done.goal),
        done.true.turned_rad(done.goal),
        done.outcome.report.session_hash,
        done.plan.notes,
    )
