"""An emulated robot localizes itself and drives to a goal; in one process, as fast as possible."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from touchline.jobs.goal.arrival import ReachedPose, arrival_figures, missed
from touchline.jobs.goal.goal_rerouting import GoalRerouting
from touchline.jobs.single.reports import (
    all_contacts,
    contact_figures,
    estimator_figures,
    hash_figures,
    hit_something,
    plan_figures,
    traversal_figures,
)
from touchline.jobs.single.simulation import GivenDrive, Outcome, Products, carry_out
from touchline.schemas.digest import goal_scenario_hash
from touchline.schemas.errors import CommandRefused
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import ContactReport, PlanOptions, PoseGoal
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import ODOMETRY, Vehicle
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import Taking

LOST_S: Final = 30.0
"""Sim time, s, in which a standing robot must be localized."""


@dataclass(frozen=True)
class GoalDrive:
    """Finished drive to a goal.

    Attributes:
        goal: The goal.
        plan: The plan from where the robot stood.
        outcome: Result of the drive.
        believed, true: Pose at rest, by the robot's estimate and in truth.
        before_s: Time under way on earlier ways, before the outcome's.
    """

    goal: PoseGoal
    plan: Plan
    outcome: Outcome
    believed: ReachedPose
    true: ReachedPose
    before_s: float = 0.0

    @property
    def problem(self) -> str:
        """Return why the drive failed; empty if it succeeded."""
        if not self.outcome.report.success:
            return self.outcome.reason or "the robot did not reach its goal"
        return missed(self.goal, self.believed, self.true) or hit_something(self.contacts)

    @property
    def taken_s(self) -> float:
        """Return the time under way, s."""
        return self.before_s + self.outcome.report.total_time_s

    @property
    def contacts(self) -> ContactReport | None:
        """Return the contacts with things on all ways; None if there were none."""
        return all_contacts([each.contacts for each in (*self.outcome.earlier, self.outcome)])

    def figures(self) -> dict[str, Any]:
        """Return the figures as a JSON object."""
        report = self.outcome.report
        planned_s = self.plan.report.total_time_s
        return {
            "success": not self.problem,
            "reason": self.problem or self.outcome.reason,
            "arrival": arrival_figures(self.goal, planned_s, self.taken_s, self.believed, self.true),
            "plan": {**plan_figures(self.plan.report), "notes": list(self.plan.notes)},
            "traversal": traversal_figures(report, self.outcome.wall_time_s),
            "estimator": estimator_figures(report),
            **({"drives": 1 + len(self.outcome.earlier)} if self.outcome.earlier else {}),
            **contact_figures(self.contacts),
            "recording": self.outcome.recording,
            "hash": hash_figures(self.outcome.scenario_hash, report),
        }


def plan_from(
    start: Sequence[float], goal: PoseGoal, vehicle: Vehicle, options: PlanOptions, ground: KnownGround = OPEN_GROUND
) -> Plan:
    """Plan from a pose, x (m), y (m), heading (rad), to a goal.

    Args:
        start: x (m), y (m), heading (rad), map frame.
        goal: The goal.
        vehicle: The robot.
        options: Planning options without a start.
        ground: Boundary and obstacles.

    Raises:
        PlanningError: There is no path.
    """
    begun = PlanOptions.model_validate({**dict(options), "start": tuple(start)})
    return plan_to_goal(goal, vehicle, begun, ground=ground)


def drive_to_goal(
    setup: Setup,
    goal: PoseGoal,
    options: PlanOptions,
    products: Products,
    progress: Callable[[float, str], None] = lambda done, doing: None,
    ground: KnownGround = OPEN_GROUND,
) -> GoalDrive:
    """Let a robot stand at its scenario's start until it is localized, plan from there, and drive.

    Args:
        setup: The robot and its world, with the start pose.
        goal: The goal.
        options: Planning options without a start.
        products: Products besides the figures.
        progress: Called with the fraction done and the present stage.
        ground: Boundary and obstacles that the plan keeps off.

    Raises:
        PlanningError: There is no such path.
        CommandRefused: The robot is not localized in time.
        RecordingError: The recording cannot be written.
    """
    emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard)
    start, taking = _standing(emulator)
    plan = plan_from(start, goal, setup.vehicle, options, ground)
    begun = PlanOptions.model_validate({**dict(options), "start": tuple(start)})
    planned = PlanCause(options=begun, goal=goal, ground=ground, known=ground.obstacles)
    drive = GivenDrive(plan.trajectory, None, taking, planned)
    rerouting = GoalRerouting(emulator, goal, options, ground) if emulator.onboard.perception is not None else None
    outcome = carry_out(emulator, drive, products, progress, rerouting)
    cause = goal_scenario_hash(setup, goal, options, ground)
    believed, true = ReachedPose(*emulator.onboard.estimate[:3]), ReachedPose(*emulator.world.pose[:3])
    before_s = rerouting.driven_s if rerouting is not None else 0.0
    return GoalDrive(goal, plan, replace(outcome, scenario_hash=cause), believed, true, before_s)


def _standing(emulator: Emulator) -> tuple[tuple[float, float, float], Taking]:
    """Let a robot find out where it stands; one with odometry alone is told.

    Returns:
        Its pose, and how it takes a way from there.

    Raises:
        CommandRefused: It is not localized in time.
    """
    if emulator.vehicle.positioning == ODOMETRY:
        pose = emulator.scenario.standing()
        return (pose.x_m, pose.y_m, pose.heading_rad), Taking.CARRIED
    while not emulator.onboard.aligned:
        if emulator.time_s > LOST_S:
            raise CommandRefused(f"the robot is not localized within {LOST_S:g} s: give a scenario with a position fix")
        emulator.tick()
    x_m, y_m, heading_rad = emulator.onboard.estimate[:3]
    return (x_m, y_m, heading_rad), Taking.HERE
