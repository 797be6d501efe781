"""Emulated robot that drives to random goals, some of which replace others under way."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from touchline.onboard import Onboard
from touchline.onboard.executive.handover import NotYet, PlanPlace, reference_ahead
from touchline.schemas.errors import CommandRefused, PlanningError
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PoseGoal, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Noise, Pose2, Scenario
from touchline.schemas.vehicles.shipped import SHIPPED, on_its_ground, with_its_own
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.tick_log import columns, commanded

FIELD_M = 5.0
HEARD_TICKS = 20
"""Delay from the request of a plan until the robot receives it."""
TRIES = 40
MILLISECOND = 1e-3
KEPT_TICKS = 1000
"""Ticks that are run, and kept, at once."""


@dataclass
class GoalChain:
    """Robot on its own ground, with a matching data sheet, and the outcomes of its goals.

    Attributes:
        taken, refused: Number of goals that took over under way; reasons where none did.
        jumps: (n, 3) jumps of the reference then: m, rad, m/s.
        ends: (n, 3) of every goal that was driven to: distance (m) and turn (rad) off it in truth, and seconds late.
        believed: (n, 2) estimated distance (m) and turn (rad) off it.
        wheel_share: Maximum planned wheel speed at any millisecond, as a fraction of the limit.
        commanded_share: Maximum commanded one; commands are held for a tick.
    """

    vehicle_name: str
    follower: str
    rng: np.random.Generator
    noise: Noise = "default"
    taken: int = 0
    refused: list[str] = field(default_factory=list)
    jumps: list[tuple[float, float, float]] = field(default_factory=list)
    ends: list[tuple[float, float, float]] = field(default_factory=list)
    believed: list[tuple[float, float]] = field(default_factory=list)
    wheel_share: float = 0.0
    commanded_share: float = 0.0

    def __post_init__(self) -> None:
        """Let the robot localise itself."""
        self.vehicle = SHIPPED[self.vehicle_name].vehicle
        start = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
        scenario = Scenario(noise=self.noise, seed=int(self.rng.integers(1, 1000)), start=start)
        self.emulator = Emulator(
            self.vehicle,
            on_its_ground(self.vehicle_name, scenario),
            with_its_own(self.vehicle_name, OnboardConfig(follower=self.follower)),
        )
        actuators = len(self.vehicle.drive.actuators)
        self._runner, self._rows = FastRunner(self.emulator), np.zeros((KEPT_TICKS, columns(actuators)))
        self._commanded = commanded(actuators)
        while not self.emulator.onboard.aligned:
            self.emulator.tick()

    def drive(self, others: int) -> None:
        """Drive to a random goal, replaced by `others` every 2 to 5 s, up to the last one."""
        goal = self._goal()
        try:
            plan = plan_to_goal(goal, self.vehicle, PlanOptions(start=self.emulator.onboard.estimate[:3]))
            self.emulator.load(plan.trajectory, taking=Taking.HERE)
        except (CommandRefused, PlanningError) as error:
            self.refused.append(str(error))
            return
        self._check_wheels(plan)
        self.emulator.start()
        for _ in range(others):
            self._run(int(100.0 * self.rng.uniform(2.0, 5.0)))
            goal, plan = self._other(goal, plan)
        self._run(100_000)
        self._end(goal, plan)

    def _goal(self) -> PoseGoal:
        x_m, y_m = self.rng.uniform(-FIELD_M, FIELD_M, 2)
        return PoseGoal(x_m=x_m, y_m=y_m, heading_rad=self.rng.uniform(-math.pi, math.pi))

    def _run(self, ticks: int) -> None:
        emulator, rows = self.emulator, self._rows
        until = emulator.tick_count + ticks
        while emulator.active and emulator.tick_count < until:
            self._runner.step(min(until - emulator.tick_count, KEPT_TICKS), rows)
            kept, last = rows[:, self._commanded], emulator.command.actuators
            drive = self.vehicle.drive
            if drive.kind == "differential":
                fastest = max(np.abs(kept).max(), np.abs(last).max())
                self.commanded_share = max(self.commanded_share, float(fastest / drive.max_wheel_speed_radps))

    def _other(self, goal: PoseGoal, plan: Plan) -> tuple[PoseGoal, Plan]:
        """Plan to another goal, repeatedly while the robot turns or stands; returns the same goal if that fails."""
        other, reason = self._goal(), "it arrived first"
        for _ in range(TRIES):
            if self.emulator.onboard.state != TraversalStatus.RUNNING:
                break
            at_m = self.emulator.onboard.status.arc_length_m
            try:
                new = plan_to_goal(
                    other,
                    self.vehicle,
                    PlanOptions(),
                    LeavingTrajectory(trajectory=plan.trajectory, arc_length_m=at_m),
                )
                self._run(HEARD_TICKS)
                self._take_over(new)
            except NotYet as error:
                reason = str(error)
                continue
            except (CommandRefused, PlanningError) as error:
                reason = str(error)
                break
            self._check_wheels(new)
            return other, new
        self.refused.append(reason)
        return goal, plan

    def _take_over(self, plan: Plan) -> None:
        before = reference_ahead(self._place())[0]
        self.emulator.load(plan.trajectory, taking=Taking.UNDER_WAY)
        apart = reference_ahead(self._place())[0] - before
        turned = abs(math.remainder(apart[2], math.tau))
        self.jumps.append((math.hypot(apart[0], apart[1]), turned, abs(apart[3])))
        self.taken += 1

    def _place(self) -> PlanPlace:
        onboard = self.emulator.onboard
        assert isinstance(onboard, Onboard)
        job = onboard._traversal.mission
        assert job is not None
        return PlanPlace(job.plan, job.driver.leg_index, job.driver.arc_length_m)

    def _check_wheels(self, plan: Plan) -> None:
        """Check both wheels of a differential drive at every millisecond of what is sent."""
        drive = self.vehicle.drive
        if drive.kind != "differential":
            return
        speeds = plan.speeds
        left_s = speeds.time_s + speeds.dwell_s
        time_s = np.arange(0.0, speeds.total_time_s, MILLISECOND)
        entry = np.clip(np.searchsorted(left_s, time_s, side="right") - 1, 0, len(left_s) - 2)
        driving_s = speeds.time_s[entry + 1] - left_s[entry]
        since_s = np.clip(time_s - left_s[entry], 0.0, driving_s)
        gain = np.diff(speeds.speed_mps)[entry] / driving_s
        speed = speeds.speed_mps[entry] + gain * since_s
        station = speeds.station_m[entry] + (speeds.speed_mps[entry] + 0.5 * gain * since_s) * since_s
        ends = np.array([each.end_m for each in plan.sent])
        curvature = np.abs([each.curve.curvature_1pm for each in plan.sent])
        bend = curvature[np.minimum(np.searchsorted(ends, station), len(ends) - 1)]
        outer = speed * (1.0 + drive.half_track_m * bend) / drive.max_speed_mps
        self.wheel_share = max(self.wheel_share, float(outer.max()))

    def _end(self, goal: PoseGoal, plan: Plan) -> None:
        status = self.emulator.onboard.status
        if status.state != TraversalStatus.DONE:
            self.refused.append(status.reason)
            return
        late_s = status.elapsed_s - plan.speeds.total_time_s
        self.ends.append((*_off(goal, self.emulator.world.pose[:3]), late_s))
        self.believed.append(_off(goal, self.emulator.onboard.estimate[:3]))


def _off(goal: PoseGoal, pose: tuple[float, float, float]) -> tuple[float, float]:
    """Distance (m) and absolute turn (rad) of a pose (x m, y m, heading rad) from a goal."""
    x_m, y_m, heading_rad = pose
    turned = abs(math.remainder(heading_rad - goal.heading_rad, math.tau))
    return math.hypot(x_m - goal.x_m, y_m - goal.y_m), turned
