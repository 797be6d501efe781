"""Traversal executive: the commands allowed in each state, and the behaviour of the robot in it.

    IDLE ──load──► READY ──start──► RUNNING ──end reached──► DONE
    IDLE, READY, DONE, ABORTED ──begin guided──► RUNNING, wherever a coordinator guides it
                                    ▲     │ pause, link lost, pose lost
                              resume│     ▼
                                    PAUSED          abort: READY, RUNNING, PAUSED → ABORTED
    RUNNING ──replace──► RUNNING, along another trajectory
    any ──estop, bumper, fence──► ESTOPPED ──reset──► PAUSED (from RUNNING or PAUSED), READY or IDLE
    DONE, ABORTED ──reset──► IDLE; DONE, ABORTED, READY ──load──► READY

Leaving RUNNING closes the valve in the same tick. All but the emergency stop then brake along the path. A pause that
the robot ordered because of its pose ends by itself, unless it lasts too long; one that a person, the lost link, the
watchdog or a hazard ordered does not. Before the robot moves off after a stop it warns for some seconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from touchline.onboard.computer_state import ComputerState
from touchline.onboard.control import Follower
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.executive.events import ERROR, INFO, WARN, EventLog
from touchline.onboard.executive.failsafe import Failsafe
from touchline.onboard.executive.geofence import Geofence
from touchline.onboard.executive.guided import GuidedDrive
from touchline.onboard.executive.handover import check_here
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.executive.mission import Mission
from touchline.onboard.executive.move_off import MoveOffRules
from touchline.onboard.executive.retry_limit import MAX_TRIES, Tries
from touchline.onboard.executive.traversal_job import TraversalJob
from touchline.onboard.interface import (
    TICK_S,
    TICKS_PER_S,
    Checkpoint,
    Command,
    MoveOffWarning,
    Pause,
    Status,
)
from touchline.onboard.trajectory.trajectory import LoadedTrajectory, load_trajectory
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import PauseStatus, Trajectory, TraversalStatus
from touchline.schemas.onboard import FenceLimits, TeamLimits
from touchline.schemas.vehicles import Vehicle

IDLE, READY, RUNNING = TraversalStatus.IDLE, TraversalStatus.READY, TraversalStatus.RUNNING
PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
ABORTED, ESTOPPED = TraversalStatus.ABORTED, TraversalStatus.ESTOPPED
NAMES = {
    IDLE: "idle",
    READY: "ready",
    RUNNING: "running",
    PAUSED: "paused",
    DONE: "done",
    ABORTED: "aborted",
    ESTOPPED: "emergency-stopped",
}

MAX_RESUME_DISTANCE_M = 0.5
EMERGENCY_STOP = "emergency stop"
ABORTED_BY_OPERATOR = "aborted by the operator"
PAUSED_BY_OPERATOR = "paused by the operator"
ABOUT_TO_MOVE = "about to move; keep clear"
BY_OPERATOR = Pause(PauseStatus.OPERATOR, "operator")
BY_LINK = Pause(PauseStatus.LINK, "link")
BY_WATCHDOG = Pause(PauseStatus.WATCHDOG, "watchdog")
BY_SHUT_DOWN = Pause(PauseStatus.SHUT_DOWN, "shut-down")
BY_EMERGENCY_STOP = Pause(PauseStatus.EMERGENCY_STOP, "emergency stop")
_BY_FOLLOWER = Pause(PauseStatus.FOLLOWER, "follower")
_BY_LOCALIZATION = Pause(PauseStatus.LOCALIZATION, "localization", ends_by_itself=True)


class Course(NamedTuple):
    """Checked trajectory with the fence round it."""

    plan: LoadedTrajectory
    fence: Geofence


class Monitors(NamedTuple):
    """Monitors that may pause or stop the robot.

    Attributes:
        localization: Evaluates the pose.
        failsafe: Evaluates everything else, and the fence that it gets with a trajectory.
        fence_limits: Margins of that fence.
        move_off: Rules for moving off again.
    """

    localization: LocalizationMonitor
    failsafe: Failsafe
    fence_limits: FenceLimits
    move_off: MoveOffRules


class Traversal:
    """State and loaded job of the robot.

    Attributes:
        state: State as in `TraversalStatus`.
        reason: Reason for this state, or what the robot waits for; "" if that needs no words.
        job: The loaded job, None while idle.
        clock: The last tick, and the time since the start.
        warning: Given from before the robot moves off until it is stopped; None while it is to stand.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        follower: Follower,
        estimator: Estimator,
        monitors: Monitors,
        computer: ComputerState,
        log: EventLog,
    ) -> None:
        """Begin in IDLE.

        Args:
            vehicle: The nominal robot.
            follower: Follower of the path.
            estimator: Estimator of the pose.
            monitors: Monitors and rules.
            computer: State of the computer.
            log: Log of the events.
        """
        self._watch, self._hazards, self._fence_limits, self._rules = monitors
        self._vehicle, self._follower, self._estimator, self._log = vehicle, follower, estimator, log
        self._computer, self.clock = computer, computer.clock
        self.state = IDLE
        self.reason = ""
        self.job: TraversalJob | None = None
        self.warning: MoveOffWarning | None = None
        self._pause: Pause | None = None
        self._why = ""  # reason of the last pause, whatever has become of it
        self._lasts = False  # True if the hazard that paused it can be seen at standstill, too
        self._stopped_tick = 0  # start of the standstill, if it pauses, or has not set off since
        self._tries = Tries()
        self._before_estop = IDLE
        self._fallbacks_before = 0  # of an earlier process, less those of earlier jobs

    def check_load(self) -> None:
        """Check that a trajectory would be accepted now.

        Raises:
            CommandRefused: It would not, in this state or because the robot moves.
        """
        self._require("load", IDLE, READY, DONE, ABORTED)
        self._require_standstill("load")

    def prepare(self, trajectory: Trajectory, boundary: Sequence[tuple[float, float]] = ()) -> Course:
        """Check a trajectory, which may take seconds; nothing is changed, so any thread may do it meanwhile.

        Args:
            trajectory: Path, speeds and actuation.
            boundary: Corners (x, y) [m] of the area that the robot is not to leave; if empty, the plan's surroundings.

        Raises:
            CommandRefused: The trajectory cannot be driven; the reason says why.
        """
        plan = load_trajectory(trajectory, self._vehicle)
        return Course(plan, Geofence(plan.path, boundary, self._vehicle, self._fence_limits))

    def take(self, course: Course, resume: Checkpoint | None = None) -> float:
        """Take a prepared course.

        Args:
            course: Result of `prepare`.
            resume: Checkpoint to begin at; None: the start.

        Returns:
            Planned duration [s].

        Raises:
            CommandRefused: Not in this state, or the checkpoint is not on the path.
        """
        self.check_load()
        plan = course.plan
        job = Mission(plan, self._vehicle, self._follower, self._estimator, self._watch, self._computer)
        if resume is not None:
            job.resume_at(resume)
        self.job, self._hazards.fence = job, course.fence
        self.clock.tick = max(self.clock.tick, resume.tick if resume is not None else 0)
        self.clock.elapsed_s = resume.elapsed_s if resume is not None else 0.0
        self._fallbacks_before = (resume.follower_fallbacks if resume is not None else 0) - self._follower.fallbacks
        self._tries = Tries()
        self._become(READY, "")
        return plan.total_time_s

    def take_here(self, course: Course) -> float:
        """Take a course that begins where the robot stands; return its planned duration [s].

        Raises:
            CommandRefused: Not in this state, or it begins elsewhere; the reason gives the distance.
        """
        self.check_load()
        check_here(course.plan, self._estimator, self._watch)
        return self.take(course)

    def take_over(self, course: Course) -> float:
        """Continue on a prepared course without a stop; return its planned duration [s].

        The time of the traversal continues as if the course had been driven from its start.

        Raises:
            CommandRefused: Not in this state, while paint is owed, or because it does not agree with the present
                course.
        """
        self._require("replace", RUNNING)
        plan, mission = course.plan, self.mission
        if mission is None:
            raise CommandRefused("cannot replace while the robot is guided by a team's coordinator; abort that first")
        arc_m = mission.take_over(plan)
        self._hazards.fence = course.fence
        self.clock.elapsed_s = plan.time_at(arc_m, 0)
        self._tries = Tries()
        self._log.report(INFO, "replaced", f"another trajectory took over under way, {arc_m:.2f} m along it")
        return plan.total_time_s

    def begin_guided(self, team: TeamLimits) -> None:
        """Follow a coordinator's guidance from now on; the robot stands until the first guidance arrives.

        Raises:
            CommandRefused: Not in this state, or this robot cannot be guided.
        """
        self.check_load()
        self.job = GuidedDrive(self._vehicle, team, self._estimator, self._watch, self._computer)
        self._hazards.take_fence_away()
        self.clock.elapsed_s = 0.0
        self._fallbacks_before = -self._follower.fallbacks
        self._tries = Tries()
        self._set_off("guided by a coordinator")

    def start(self) -> None:
        """Begin: align, then drive."""
        self._require("start", READY)
        self._set_off("started")

    def pause(self, reason: str = PAUSED_BY_OPERATOR, by: Pause = BY_OPERATOR) -> None:
        """Close the valve and brake along the path; a pause that would have ended by itself now waits for a person.

        Args:
            reason: Shown to the operator.
            by: Cause and source of the pause.

        Raises:
            CommandRefused: Not in this state.
        """
        if not self._ends_by_itself:
            self._require("pause", RUNNING)
        self._halt(by, reason)

    def resume(self) -> None:
        """Continue from where paint is owed; if the receiver has jumped for good, its new position is accepted.

        Raises:
            CommandRefused: Not in this state, or the cause of the pause persists.
        """
        self._require("resume", PAUSED)
        job = self._loaded()
        problem = self._hazards.lasting
        if problem:
            raise CommandRefused(f"cannot resume: {problem}")
        self._hazards.forget()
        if not job.aligning:
            jump_m = self._estimator.jump_m
            accepts = jump_m > 0.0 and job.standing and self._watch.accepts_jump()
            if self._watch.pose_problem and not accepts:
                raise CommandRefused(f"cannot resume: {self._watch.pose_problem}")
            if accepts:
                self._estimator.accept_jump()
                self.report_accepted(jump_m)
            distance = job.locate() if job.standing else 0.0
            if distance > MAX_RESUME_DISTANCE_M:
                raise CommandRefused(f"cannot resume: the robot stands {distance:.2f} m beside its path")
        self._tries.forgive()
        self._go_on(job, "resumed")

    def report_accepted(self, moved_m: float) -> None:
        """Report that the position was moved by this distance [m] to that of the receiver or camera."""
        self._log.report(
            WARN, "position-accepted", f"the position was moved by {moved_m:.2f} m to the {self._watch.source}'s"
        )

    def abort(self, reason: str = ABORTED_BY_OPERATOR) -> None:
        """Abort the traversal.

        Raises:
            CommandRefused: Not in this state.
        """
        self._require("abort", READY, RUNNING, PAUSED)
        self._leave_running(ABORTED, reason)

    def estop(self, reason: str = EMERGENCY_STOP) -> None:
        """Stop as hard as the wheels can; always allowed."""
        if self.state != ESTOPPED:
            self._stop_hard(reason)

    def reset(self) -> None:
        """Release an emergency stop once the robot stands, or clear a finished or aborted traversal.

        Raises:
            CommandRefused: Not in this state, while the bumper is pressed, or while the robot moves.
        """
        self._require("reset", ESTOPPED, DONE, ABORTED)
        if self._hazards.findings.bumper:
            raise CommandRefused("cannot reset while the bumper is pressed")
        self._require_standstill("reset")
        if self.state == ESTOPPED and self._before_estop in (RUNNING, PAUSED):
            self._halt(BY_EMERGENCY_STOP, "emergency stop released; resume to go on from where paint stopped")
        elif self.state == ESTOPPED and self._before_estop == READY:
            self._become(READY, "")
        else:
            self.job = None
            self._become(IDLE, "")

    def authorize(self, until_m: float) -> None:
        """Allow driving up to this arc length only [m], which later calls may extend; inf: to the end.

        Raises:
            CommandRefused: Nothing is loaded.
        """
        if self.mission is None:
            raise CommandRefused("cannot authorize a drive: no trajectory is loaded; load one first")
        self.mission.driver.authorize(until_m)

    def link_lost(self) -> None:
        """Pause if running; a pause that would have ended by itself now waits for the operator."""
        if self.state == RUNNING or self._ends_by_itself:
            self.pause("the link to the operator is lost", BY_LINK)

    def step(self, tick: int) -> Command:
        """Return the command until the next tick; the estimator and the monitors have seen this one."""
        self.clock.tick = tick
        job = self.job
        if job is None:
            return self._computer.command.standstill
        if self.state in (RUNNING, PAUSED):
            self.clock.elapsed_s += TICK_S
        self._heed_hazards(job)
        if self.state == RUNNING:
            return self._run(job)
        if self.state == ESTOPPED:
            return job.stop_hard()
        command = job.rest()
        if self._ends_by_itself:
            self._try_again(job)
        elif self._lasts:
            self.reason = self._hazards.lasting or f"over: {self._why}; resume to go on"
        return command

    @property
    def nominal(self) -> bool:
        """True if `nominal_tick` can run the next tick, as far as can be seen before it."""
        if self.state != RUNNING or self.reason or self._warns_in(self.clock.tick + 1):
            return False
        return self._loaded().nominal and not self._follower.can_fail and not self._follower.problem

    def driven(self, tick: int) -> None:
        """Account for the ticks up to this one, which `nominal_tick` has run."""
        self.clock.tick = tick
        if self.mission is not None:
            self.mission.sprayer.count_closed()

    @property
    def begins_at(self) -> tuple[float, float, float]:
        """Pose at which the loaded mission begins: east [m], north [m], heading [rad]."""
        assert self.mission is not None, "a trajectory was taken"
        return self.mission.begins_at

    @property
    def checkpoint(self) -> Checkpoint | None:
        """Checkpoint from which the traversal could continue, also after an abort; None if there is none."""
        state = self._before_estop if self.state == ESTOPPED else self.state
        place = self.job.place if self.job is not None and state in (RUNNING, PAUSED, ABORTED) else None
        return Checkpoint(*place, self.clock.tick, self.clock.elapsed_s, self._fallbacks) if place is not None else None

    @property
    def mission(self) -> Mission | None:
        """The job, if it is one along a trajectory."""
        return self.job if isinstance(self.job, Mission) else None

    @property
    def guided(self) -> GuidedDrive | None:
        """The job, if the robot is guided."""
        return self.job if isinstance(self.job, GuidedDrive) else None

    @property
    def _fallbacks(self) -> int:
        return self._fallbacks_before + self._follower.fallbacks

    def status(self) -> Status:
        """Return the status of the traversal."""
        job = self.job
        if job is None:
            return Status(state=self.state, reason=self.reason, follower_fallbacks=self._fallbacks)
        done = job.progress
        return Status(
            self.state,
            self.reason,
            done.segment_index,
            done.segment_count,
            done.segment_id,
            done.arc_length_m,
            done.total_length_m,
            self.clock.elapsed_s,
            0.0 if self.state in (DONE, ABORTED) else done.remaining_s,
            self._fallbacks,
            self._pause_now,
        )

    @property
    def _pause_now(self) -> Pause | None:
        """The pause, with the earliest end of one that ends by itself as it is known now."""
        if self._pause is None or not self._pause.ends_by_itself:
            return self._pause
        if self.warning is not None:
            return self._pause._replace(earliest_tick=self.warning.earliest_tick)
        settled_tick = math.ceil(max(self.clock.tick, TICKS_PER_S * self._watch.findings.settled_at_s))
        return self._pause._replace(earliest_tick=settled_tick + self._rules.warning_ticks)

    @property
    def _ends_by_itself(self) -> bool:
        """True if the robot pauses and will move off without a person."""
        return self._pause is not None and self._pause.ends_by_itself

    def _heed_hazards(self, job: TraversalJob) -> None:
        hazards = self._hazards
        if hazards.emergency and self.state in (READY, RUNNING, PAUSED):
            self._stop_hard(hazards.emergency)
        elif hazards.stop and self.state == RUNNING:
            job.owe_dry(hazards.findings.dry_s)
            self._halt(hazards.pause, hazards.stop, ERROR)
            self._lasts = hazards.stop == hazards.lasting
        elif hazards.stop and self._ends_by_itself:
            self._halt(hazards.pause, hazards.stop, ERROR)
            self._lasts = hazards.stop == hazards.lasting

    def _stop_hard(self, reason: str) -> None:
        self._before_estop = self.state
        if self.job is not None:
            self.job.close_valve()
        self._become(ESTOPPED, reason, ERROR)

    def _run(self, job: TraversalJob) -> Command:
        if self._warns_in(self.clock.tick) and (self._estimator.aligned or not job.aligning):
            self.reason = ABOUT_TO_MOVE
            return job.rest()
        step = job.run()
        if step.done:
            self._leave_running(DONE, "")
        elif step.refusal:
            self._leave_running(ABORTED, step.refusal, ERROR)
        elif self._follower.problem:
            job.close_valve(in_s=0.0)
            self._halt(_BY_FOLLOWER, self._follower.problem, ERROR)
            return step.command._replace(valve=False, disc=False, valve_after_s=0.0)
        elif step.hold:
            self._halt(_BY_LOCALIZATION, step.hold, WARN)
        else:
            self.reason = _waits_for(job)
            if (job.aligning or job.waiting) and self._rules.needs_person(self._stopped_tick, self.clock.tick):
                self._wait_for_person(_BY_LOCALIZATION, f"not ready to set off for {self._longest}: {self.reason}")
        return step.command

    def _try_again(self, job: TraversalJob) -> None:
        """Warn, then end the pause, once the pose has been good for a while and the robot stands."""
        tick, pause = self.clock.tick, self._pause or _BY_LOCALIZATION
        settled = job.standing and self._watch.settled(tick / TICKS_PER_S)
        if not settled:
            self.warning = None
        problem = self._watch.drive_problem() or self._watch.pose_problem
        self.reason = problem or (self._why if self.warning is None else ABOUT_TO_MOVE)
        earliest_tick = tick + self._rules.warning_ticks if self.warning is None else self.warning.earliest_tick
        if self._rules.needs_person(self._stopped_tick, earliest_tick):
            self._wait_for_person(pause, f"stopped for more than {self._longest}: {self.reason}")
        elif settled and (self.warning is None or tick >= self.warning.earliest_tick):
            self._end_pause(job, pause)

    def _end_pause(self, job: TraversalJob, pause: Pause) -> None:
        """Warn that the pause is about to end, or, after that, end it."""
        distance = 0.0 if job.aligning else job.locate()
        if distance > MAX_RESUME_DISTANCE_M:
            self._wait_for_person(pause, f"the robot stands {distance:.2f} m beside its path")
        elif self.warning is not None:
            self._go_on(job, self.warning.reason)
        elif not self._tries.another(job.next_paint_m):
            self._wait_for_person(pause, f"gave up after {MAX_TRIES} tries: {self._why}")
        else:
            self._warn("goes on by itself", self._rules.warning_ticks)
            seconds = f"{self._rules.warning_ticks / TICKS_PER_S:g} s"
            self._log.report(WARN, "about-to-move", f"about to move: the robot goes on by itself in {seconds}")

    def _wait_for_person(self, pause: Pause, reason: str) -> None:
        self._halt(pause._replace(ends_by_itself=False), f"{reason}; resume to go on", ERROR)

    @property
    def _longest(self) -> str:
        return f"{self._rules.longest_stop_s:g} s"

    def _set_off(self, reason: str) -> None:
        """Begin to run at standstill."""
        self._stopped_tick = self.clock.tick
        self._become(RUNNING, "")
        self._warn(reason, self._rules.start_warning_ticks)

    def _go_on(self, job: TraversalJob, reason: str) -> None:
        """Continue after a pause: with the present warning, or a new one unless the robot still moves."""
        warning, self._stopped_tick = self.warning, self.clock.tick
        self._become(RUNNING, "")
        if warning is not None or not job.standing:
            self.warning = warning or MoveOffWarning(self.clock.tick, reason)
        else:
            self._warn(reason, self._rules.warning_ticks)
        job.go_on()

    def _warn(self, reason: str, ticks: int) -> None:
        """Begin to warn; the robot does not move off in so many ticks."""
        self.warning = MoveOffWarning(self.clock.tick + ticks, reason)

    def _warns_in(self, tick: int) -> bool:
        """Return True if the robot has to stand in this tick because it warns."""
        return self.warning is not None and tick < self.warning.earliest_tick

    def _halt(self, by: Pause, reason: str, severity: int = INFO) -> None:
        """Pause, or turn a pause into another one."""
        if self.state == RUNNING:
            self._loaded().close_valve()
            self._stopped_tick = self.clock.tick
        self._become(PAUSED, reason, severity)
        self._pause, self._why, self._lasts = by, reason, False

    def _leave_running(self, state: int, reason: str, severity: int = INFO) -> None:
        self._loaded().close_valve()
        self._become(state, reason, severity)

    def _loaded(self) -> TraversalJob:
        assert self.job is not None, "every state but IDLE has a job"
        return self.job

    def _require(self, command: str, *states: int) -> None:
        if self.state not in states:
            allowed = " or ".join(NAMES[state] for state in states)
            remedy = "; reset it first" if self.state == ESTOPPED else ""
            raise CommandRefused(f"cannot {command} while {NAMES[self.state]}; only while {allowed}{remedy}")

    def _require_standstill(self, command: str) -> None:
        if self.job is not None and not self.job.standing:
            raise CommandRefused(f"cannot {command} while the robot is moving")

    def _become(self, state: int, reason: str, severity: int = INFO) -> None:
        self.state, self.reason, self.warning, self._pause = state, reason, None, None
        self._log.report(severity, NAMES[state], f"{NAMES[state]}: {reason}" if reason else NAMES[state])


def _waits_for(job: TraversalJob) -> str:
    """Return what a running job that has not set off waits for, "" if it has."""
    if job.waiting:
        return "waiting: the accelerometer contradicts the standing wheels"
    if job.held:
        return "waiting: others are in the way further on"
    return "aligning: standing until the position has settled" if job.aligning else ""
