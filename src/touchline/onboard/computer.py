"""The robot's own computer: sensor frames in, actuator commands out, one call per 10 ms tick."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.timed_motion import COLUMNS
from touchline.onboard.computer_state import Computer, ComputerState
from touchline.onboard.control import Ask, Follower, make_follower, nobody
from touchline.onboard.control.follower import Asking, answered
from touchline.onboard.control.guarded_follower import GuardedFollower
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.auxiliary_models import AuxiliarySensors
from touchline.onboard.estimation.consistency_monitor import compared_innovations
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.report import report
from touchline.onboard.executive.course import Course, prepare_course
from touchline.onboard.executive.dead_reckoning import dead_reckoning
from touchline.onboard.executive.events import WARN, EventLog
from touchline.onboard.executive.failsafe import Failsafe
from touchline.onboard.executive.guided_tick import GuidedCourse
from touchline.onboard.executive.localization_monitor import LocalizationMonitor, pose_limits
from touchline.onboard.executive.move_off import MoveOffRules
from touchline.onboard.executive.stop_causes import (
    ABORTED_BY_OPERATOR,
    BY_OPERATOR,
    EMERGENCY_STOP,
    PAUSED_BY_OPERATOR,
)
from touchline.onboard.executive.traversal import Monitors, Traversal
from touchline.onboard.interface import (
    AuxiliarySample,
    Checkpoint,
    Command,
    Consistency,
    Estimate,
    MoveOffWarning,
    OnboardEvent,
    PaintBelief,
    Pause,
    SensorFrame,
    Status,
)
from touchline.onboard.nominal_tick import CourseArrays
from touchline.onboard.perception.perception import Perception, lidars_of
from touchline.onboard.protection.protector import Blocked, Protector
from touchline.onboard.tracking_state import HEADING_ERROR, NOZZLE_LATERAL, REFERENCE_SPEED
from touchline.schemas.messages import Guidance, PlanState, Trajectory, TraversalStatus, Whereabouts
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle


class Nominal(NamedTuple):
    """Data that `nominal_tick` needs to run ticks in which nothing has to be decided.

    Attributes:
        computer: (1,) state of the computer, for kernels.
        course: Arrays of the leg, valve and fence.
        follower: Follower that is called between `steer` and `actuate`.
        now: (NOW,) input of the follower, laid out as in `tracking_state`; the path ahead is in `course.leg`.
    """

    computer: Computer
    course: CourseArrays
    follower: GuardedFollower
    now: NDArray[np.float64]


class Onboard:
    """Estimator, monitors and traversal executive of one robot.

    Commands raise `CommandRefused` with the reason and then change nothing.

    Args:
        vehicle: The nominal robot.
        config: Follower, data sheets of the sensors, fence.
        ask: Function that calls an external follower.
        follower: Follower in place of the configured one.

    Attributes:
        perception: Surroundings of the robot by its lidars; None without one.
        protection: Protection against contact, which takes what the robot's lidars see.
    """

    def __init__(
        self, vehicle: Vehicle, config: OnboardConfig, ask: Ask = nobody, follower: Follower | None = None
    ) -> None:
        self._log = EventLog()
        self._state, self._drive = ComputerState.sized(len(vehicle.drive.actuators))(), drive_of(vehicle)
        self._estimator = Estimator(vehicle, config, self._state)
        self._watch = LocalizationMonitor(self._state, pose_limits(vehicle, config))
        self._vehicle, self._fence_limits, self._team = vehicle, config.fence, config.team
        self._drive_sheet = config.drive
        name = config.follower if follower is None else follower.name
        follower = make_follower(config.follower, vehicle, ask, config) if follower is None else follower
        self._follower = GuardedFollower(follower, name, self._drive)
        self._hazards = Failsafe(vehicle, self._state, config.fence.timeout_s)
        self.protection = Protector(
            vehicle, config.drive.grip, self._drive, self._state, partial(self._log.report, WARN, "protection")
        )
        rules = MoveOffRules(config.move_off, vehicle, watches_all_round=self.protection.watches_all_round)
        monitors = Monitors(self._watch, self._hazards, rules, self.protection)
        self._traversal = Traversal(vehicle, self._follower, self._estimator, monitors, self._state, self._log)
        self._auxiliary = AuxiliarySensors(vehicle, self._estimator)
        self.perception = Perception(vehicle) if lidars_of(vehicle) else None
        self._estimate: tuple[int, Estimate] | None = None

    def check_load(self) -> None:
        """Check that a trajectory would be accepted now.

        Raises:
            CommandRefused: It would not.
        """
        self._traversal.check_load()

    def prepare(
        self,
        trajectory: Trajectory,
        boundary: Sequence[tuple[float, float]] = (),
        obstacles: Sequence[Sequence[tuple[float, float]]] = (),
    ) -> Course:
        """Check a trajectory without changing anything, so any thread may do it while the robot works.

        Args:
            trajectory: Path, speeds and actuation.
            boundary: Corners (x, y) [m] inside which the robot stays, map frame; if empty, the plan's surroundings.
            obstacles: Corners (x, y) [m] of the things that the plan knows.

        Raises:
            CommandRefused: It cannot be driven.
        """
        course = prepare_course(trajectory, boundary, self._vehicle, self._fence_limits)
        return course._replace(obstacles=obstacles)

    def load(
        self,
        trajectory: Trajectory,
        resume: Checkpoint | None = None,
        boundary: Sequence[tuple[float, float]] = (),
    ) -> float:
        """Check and take a trajectory: `prepare` and `take` in one call.

        Args:
            trajectory: Path, speeds and actuation.
            resume: Checkpoint to begin at; None: the start.
            boundary: Corners (x, y) [m] of the area to stay in, as in `prepare`.

        Returns:
            Planned duration [s].

        Raises:
            CommandRefused: It cannot be driven, or not now.
        """
        self.check_load()
        return self.take(self.prepare(trajectory, boundary), resume)

    def take(self, course: Course, resume: Checkpoint | None = None) -> float:
        """Take a prepared course.

        The estimator aligns anew, because the robot may have been carried to the start.

        Args:
            course: Result of `prepare`.
            resume: Checkpoint to begin at; None: the start.

        Returns:
            Planned duration [s].
        """
        duration_s = self._traversal.take(course, resume)
        self._estimator.restart(self._traversal.begins_at, resume.learned if resume is not None else ())
        if self.perception is not None:
            self.perception.restart(course.obstacles)
        self._estimate = None
        return duration_s

    def take_here(self, course: Course) -> float:
        """Take a course that begins where the robot stands; unlike with `take`, the estimator continues."""
        duration_s = self._traversal.take_here(course)
        if self.perception is not None:
            self.perception.restart(course.obstacles)
        return duration_s

    def take_over(self, course: Course) -> float:
        """Continue on a prepared course while driving, without a stop; return its planned duration [s]."""
        duration_s = self._traversal.take_over(course)
        if self.perception is not None:
            self.perception.know(course.obstacles)
        return duration_s

    def begin_guided(self, *, plans: bool = False, margin_m: float = 0.0) -> None:
        """Follow a coordinator's guidance from now on; the robot stands until the first guidance arrives.

        Args:
            plans: Whether guidance has plans instead of cells.
            margin_m: Distance by which the robot may be off its guidance; 0: any.

        Raises:
            CommandRefused: Not now, or not such a robot.
        """
        blind = dead_reckoning(margin_m, self._vehicle.drive, self._drive_sheet)
        self._traversal.begin_guided(self._team, blind, plans=plans)

    def take_guidance(self, guidance: Guidance) -> bool:
        """Take guidance from the coordinator; return False if it cannot be used or the robot is not guided."""
        guided = self._traversal.guided
        return guided is not None and guided.receive(guidance)

    def forget_cell(self) -> None:
        """Brake, as of `GuidedDrive.forget_cell`; the robot is guided."""
        if (guided := self._traversal.guided) is not None:
            guided.forget_cell()

    @property
    def guided(self) -> bool:
        """True if a coordinator guides the robot, emergency-stopped or not."""
        over = self._traversal.state in (TraversalStatus.DONE, TraversalStatus.ABORTED)
        return self._traversal.guided is not None and not over

    @property
    def whereabouts(self) -> Whereabouts | None:
        """Message of a robot to a coordinator that guides it by cells; None if none does."""
        guided = self._traversal.guided
        return guided.whereabouts if guided is not None and self.guided else None

    @property
    def plan_state(self) -> PlanState | None:
        """Message of a robot to a coordinator that guides it by plans; None if none does."""
        guided = self._traversal.guided
        return guided.plan_state if guided is not None and self.guided else None

    @property
    def must_stand(self) -> bool:
        """True if a guided robot stands, or will at the end of its plan, as it has had no fix for too long."""
        guided = self._traversal.guided
        return guided is not None and self.guided and guided.must_stand

    @property
    def followed_plan(self) -> tuple[NDArray[np.float64], float]:
        """Plan that a guided robot follows, as of `GuidedDrive.plan`; empty if none."""
        guided = self._traversal.guided
        return guided.plan if guided is not None else (np.zeros((0, COLUMNS)), 0.0)

    def start(self) -> None:
        """Begin the traversal."""
        self._traversal.start()

    def pause(self, reason: str = PAUSED_BY_OPERATOR, by: Pause = BY_OPERATOR) -> None:
        """Close the valve and brake along the path.

        Args:
            reason: Shown to the operator.
            by: Cause and source of the pause.
        """
        self._traversal.pause(reason, by)

    def resume(self) -> None:
        """Continue after a pause, from where paint stopped."""
        self._traversal.resume()

    def abort(self, reason: str = ABORTED_BY_OPERATOR) -> None:
        """Brake and abort the traversal."""
        self._traversal.abort(reason)

    def estop(self, reason: str = EMERGENCY_STOP) -> None:
        """Stop as hard as possible and latch until `reset`."""
        self._traversal.estop(reason)

    def reset(self) -> None:
        """Release an emergency stop, or clear a finished traversal."""
        self._traversal.reset()

    def authorize(self, until_m: float) -> None:
        """Allow driving up to this arc length [m], which later calls may extend; inf: to the end."""
        self._traversal.authorize(until_m)

    def link_lost(self) -> None:
        """Pause because the link to the operator is lost."""
        self._traversal.link_lost()

    def take_samples(self, samples: Sequence[AuxiliarySample]) -> None:
        """Use measurements of auxiliary sensors; call it before the first tick that follows their arrival."""
        if self.perception is not None:
            samples = self._perceived(samples, self.perception)
        for flaw in self._auxiliary.take(samples):
            self._log.report(WARN, "sensor-failed", f"{flaw}; it is not used any more")
        self._estimate = None

    def _perceived(self, samples: Sequence[AuxiliarySample], perception: Perception) -> list[AuxiliarySample]:
        """Let perception take the scans of lidars; return all other samples."""
        for sample in filter(perception.takes, samples):
            for place in perception.take(sample, self._estimator):
                x, y = perception.known.outlines[place].mean(axis=0).tolist()
                self._log.report(WARN, "obstacle-missing", f"the plan's obstacle at ({x:.1f}, {y:.1f}) m is not there")
            if (hits := perception.hits) is not None:
                self.protection.take(hits)
        return [sample for sample in samples if not perception.takes(sample)]

    def step(self, frame: SensorFrame) -> Command:
        """Run one tick; frames must come in order, without gaps."""
        self.perceive(frame)
        return answered(self.decide(frame.tick), self._follower)

    def perceive(self, frame: SensorFrame) -> None:
        """Estimate the pose, and evaluate it and all hazards: the first part of `step`."""
        self._estimator.step(frame)
        if (jump := self._estimator.accept_lasting_jump()) is not None:
            self._traversal.report_accepted(jump)
        self._watch.look(frame.tick)
        self._hazards.look(frame.tick)

    def decide(self, tick: int) -> Asking[Command]:
        """Finish a tick that estimator and monitors have seen: the executive's part of `step`."""
        self._report_of_itself()
        before = tuple(self._state.command.actuators.tolist())
        command = yield from self._traversal.step(tick)
        if command is self._state.command.standstill:
            command = command._replace(actuators=self._drive.resting(before))
        return self._state.command.give(command)

    def _report_of_itself(self) -> None:
        """Report what the estimator has found about itself or the robot's files; to be consistent again is no event."""
        counters, findings = self._estimator.counters, self._watch.findings
        if counters.inconsistent and not findings.inconsistent:
            correlation = counters.fix_cross / counters.fix_power
            self._log.report(
                WARN,
                "estimate-inconsistent",
                f"{compared_innovations(self._estimator.fix_lag)} are correlated by {correlation:.2f}: the position "
                "may err by more than its σ says; `touchline calibrate` looks for the cause in the recording",
            )
        findings.inconsistent = counters.inconsistent
        new = counters.differing & ~findings.differing
        for i, constant in enumerate(self._estimator.constants if new else ()):
            if new >> i & 1:
                remedy = "the estimate allows for it, `touchline calibrate` writes it to the files"
                self._log.report(WARN, "files-differ", f"{constant}; {remedy}")
        findings.differing = counters.differing

    def nominal(self, tick: int) -> Nominal | None:
        """Return the inputs of `nominal_tick` for the ticks after `tick`; None if the next one may need a decision."""
        estimator, job = self._estimator, self._traversal.mission
        buffer = estimator.buffer
        if job is None or not self._traversal.nominal or not buffer.imu_tick == buffer.encoder_tick == tick:
            return None
        driver = job.driver
        course = CourseArrays(
            self._hazards.fence_arrays, job.sprayer.switches, driver.leg_arrays, driver.leg.sense, estimator.drive
        )
        return Nominal(self._state.array, course, self._follower, driver.now)

    def guided_course(self, tick: int) -> GuidedCourse | None:
        """Return a guided robot's course for the ticks after `tick`; None if the next one may need a decision."""
        buffer, job = self._estimator.buffer, self._traversal.guided
        if job is None or not self._traversal.nominal or not buffer.imu_tick == buffer.encoder_tick == tick:
            return None
        return job.course

    @property
    def steady(self) -> bool:
        """True if the robot is guided and, in nominal ticks, only the motion in its messages changes."""
        tick, guided = self._estimator.times.tick, self._traversal.guided
        silent = self.perception is None and self._log.empty and guided is not None and not guided.forgot
        return silent and self.guided_course(tick) is not None and not self.must_stand

    def driven(self, tick: int) -> Command:
        """Account for the ticks up to this one, which `nominal_tick` has run; return the command in force."""
        self._traversal.driven(tick)
        return self._state.command.command

    def take_events(self) -> list[OnboardEvent]:
        """Return and clear the events since the last call."""
        return self._log.take()

    @property
    def drive_problem(self) -> str:
        """Reason for which its pose is not good enough to drive at all; "" if it is."""
        return self._watch.drive_problem()

    @property
    def blocked(self) -> Blocked | None:
        """Thing in the robot's way; None if it may move, or its lidar is silent."""
        return self.protection.blocked

    @property
    def follower(self) -> Follower:
        """Follower that is asked in `decide`."""
        return self._follower

    @property
    def auxiliary(self) -> AuxiliarySensors:
        """Auxiliary sensors, and how many of their measurements were used."""
        return self._auxiliary

    @property
    def estimator(self) -> Estimator:
        """Estimator of the robot's pose and twist."""
        return self._estimator

    @property
    def computer(self) -> Computer:
        """State for kernels, (1,)."""
        return self._state.array

    @property
    def progress(self) -> tuple[float, ...]:
        """Arc length [m], errors of nozzle [m] and heading [rad], reference speed [m/s], state of the traversal."""
        leg = self._state.leg
        return leg.arc_m, *leg.now[[NOZZLE_LATERAL, HEADING_ERROR, REFERENCE_SPEED]].tolist(), self.state

    @property
    def state(self) -> int:
        """State of the traversal, as in `TraversalStatus`."""
        return self._traversal.state

    @property
    def warning(self) -> MoveOffWarning | None:
        """Warning that the robot gives before and while it moves; None while it is to stand."""
        return self._traversal.stop.warning

    @property
    def held(self) -> bool:
        """True if the robot, under way, has come to the end of its authority."""
        mission = self._traversal.mission
        return mission is not None and mission.held

    @property
    def aligned(self) -> bool:
        """True if the pose is known well enough to drive off."""
        return self._estimator.aligned

    @property
    def checkpoint(self) -> Checkpoint | None:
        """Checkpoint from which another process could continue this traversal; None if none is running or paused."""
        return self._traversal.checkpoint

    @property
    def status(self) -> Status:
        """Status of the traversal."""
        return self._traversal.status()

    @property
    def estimate(self) -> Estimate:
        """Pose, twist and covariance at the last tick."""
        tick = self._estimator.times.tick
        if self._estimate is None or self._estimate[0] != tick:
            self._estimate = tick, self._estimator.estimate()
        return self._estimate[1]

    @property
    def lateral_error_m(self) -> float:
        """Estimated distance of the nozzle to the left of its path [m]."""
        job = self._traversal.job
        return job.lateral_error_m if job is not None else 0.0

    @property
    def spraying(self) -> bool:
        """True if the valve is commanded open."""
        job = self._traversal.job
        return job is not None and job.spraying

    @property
    def painted(self) -> PaintBelief:
        """Estimated paint of the loaded trajectory."""
        job = self._traversal.job
        return job.painted if job is not None else PaintBelief()

    @property
    def consistency(self) -> Consistency:
        """Consistency of the estimator: innovations, NIS, uses and rejections."""
        estimator = self._estimator
        if not estimator.started:
            return Consistency()
        return report(estimator.counters, estimator.position_sigma_m, estimator.heading_sigma_rad)
