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
the robot ordered because of its pose, or for something in its way, ends by itself, unless it lasts too long; one that a
person, the lost link, the watchdog or a hazard ordered does not. Before the robot moves off after a stop it warns for
some seconds.
"""

from __future__ import annotations

from typing import NamedTuple

from touchline.onboard.computer_state import ComputerState
from touchline.onboard.control.follower import Asking, Follower
from touchline.onboard.estimation.filter import AcceptedJump, Estimator
from touchline.onboard.executive.course import Course
from touchline.onboard.executive.dead_reckoning import DeadReckoning
from touchline.onboard.executive.events import ERROR, INFO, WARN, EventLog
from touchline.onboard.executive.failsafe import Failsafe
from touchline.onboard.executive.guided import GuidedDrive
from touchline.onboard.executive.handover import check_here
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.executive.mission import Mission
from touchline.onboard.executive.move_off import MoveOffRules
from touchline.onboard.executive.retry_limit import Tries
from touchline.onboard.executive.stop import ABOUT_TO_MOVE, MAX_RESUME_DISTANCE_M, TraversalStop
from touchline.onboard.executive.stop_causes import (
    ABORTED_BY_OPERATOR,
    BY_EMERGENCY_STOP,
    BY_FOLLOWER,
    BY_LINK,
    BY_LOCALIZATION,
    BY_OPERATOR,
    BY_PROTECTION,
    EMERGENCY_STOP,
    PAUSED_BY_OPERATOR,
)
from touchline.onboard.executive.traversal_job import TraversalJob
from touchline.onboard.executive.traversal_states import (
    ABORTED,
    DONE,
    ESTOPPED,
    IDLE,
    NAMES,
    PAUSED,
    READY,
    RUNNING,
    require_state,
)
from touchline.onboard.interface import TICK_S, Checkpoint, Command, Pause, Status
from touchline.onboard.protection.protector import Protector
from touchline.schemas.errors import CommandRefused
from touchline.schemas.onboard import TeamLimits
from touchline.schemas.vehicles import Vehicle


class Monitors(NamedTuple):
    """Monitors that may pause or stop the robot.

    Attributes:
        localization: Evaluates the pose.
        failsafe: Evaluates everything else, and the fence that it gets with a trajectory.
        move_off: Rules for moving off again.
        protection: Protection against contact.
    """

    localization: LocalizationMonitor
    failsafe: Failsafe
    move_off: MoveOffRules
    protection: Protector


class Traversal:
    """State and loaded job of the robot.

    Attributes:
        state: State as in `TraversalStatus`.
        reason: Reason for this state, or what the robot waits for; "" if that needs no words.
        job: The loaded job, None while idle.
        clock: The last tick, and the time since the start.
        stop: The pause, and the warning before the robot moves off.
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
        """Begin in IDLE."""
        self._watch, self._hazards, rules, self._protection = monitors
        self._vehicle, self._follower, self._estimator, self._log = vehicle, follower, estimator, log
        self._computer, self.clock = computer, computer.clock
        self.state = IDLE
        self.reason = ""
        self.job: TraversalJob | None = None
        self.stop = TraversalStop(rules, computer, self._watch, self._protection, log)
        self._before_estop = IDLE
        self._fallbacks_before = 0  # of an earlier process, less those of earlier jobs

    def check_load(self) -> None:
        """Check that a trajectory would be accepted now.

        Raises:
            CommandRefused: It would not, in this state or because the robot moves.
        """
        require_state(self.state, "load", IDLE, READY, DONE, ABORTED)
        self._require_standstill("load")

    def take(self, course: Course, resume: Checkpoint | None = None) -> float:
        """Take a prepared course.

        Args:
            course: Result of `prepare_course`.
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
        self.stop.tries = Tries()
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
        require_state(self.state, "replace", RUNNING)
        plan, mission = course.plan, self.mission
        if mission is None:
            raise CommandRefused("cannot replace while the robot is guided by a team's coordinator; abort that first")
        arc_m = mission.take_over(plan)
        self._hazards.fence = course.fence
        self.clock.elapsed_s = plan.time_at(arc_m, 0)
        self.stop.tries = Tries()
        self._log.report(INFO, "replaced", f"another trajectory took over under way, {arc_m:.2f} m along it")
        return plan.total_time_s

    def begin_guided(self, team: TeamLimits, blind: DeadReckoning, *, plans: bool) -> None:
        """Follow a coordinator's guidance from now on; the robot stands until the first guidance arrives.

        Args:
            team: Limits of the team.
            blind: Limits of driving without fixes.
            plans: Whether guidance has plans instead of cells.

        Raises:
            CommandRefused: Not in this state, or this robot cannot be guided.
        """
        self.check_load()
        self.job = GuidedDrive(self._vehicle, team, blind, self._estimator, self._watch, self._computer, plans=plans)
        self._hazards.take_fence_away()
        self.clock.elapsed_s = 0.0
        self._fallbacks_before = -self._follower.fallbacks
        self.stop.tries = Tries()
        self._set_off("guided by a coordinator")

    def start(self) -> None:
        """Begin: align, then drive."""
        require_state(self.state, "start", READY)
        self._set_off("started")

    def pause(self, reason: str = PAUSED_BY_OPERATOR, by: Pause = BY_OPERATOR) -> None:
        """Close the valve and brake along the path; a pause that would have ended by itself now waits for a person.

        Args:
            reason: Shown to the operator.
            by: Cause and source of the pause.

        Raises:
            CommandRefused: Not in this state.
        """
        if not self.stop.ends_by_itself:
            require_state(self.state, "pause", RUNNING)
        self._halt(by, reason)

    def resume(self) -> None:
        """Continue from where paint is owed; if the receiver has jumped for good, its new position is accepted.

        Raises:
            CommandRefused: Not in this state, or the cause of the pause persists.
        """
        require_state(self.state, "resume", PAUSED)
        job = self._loaded()
        problem = self._hazards.lasting
        if problem:
            raise CommandRefused(f"cannot resume: {problem}")
        if not job.aligning:
            accepts = self._estimator.jump_m > 0.0 and job.standing and self._watch.accepts_jump()
            if self._watch.pose_problem and not accepts:
                raise CommandRefused(f"cannot resume: {self._watch.pose_problem}")
            if accepts:
                self.report_accepted(self._estimator.accept_jump())
            distance = job.locate() if job.standing else 0.0
            if distance > MAX_RESUME_DISTANCE_M:
                raise CommandRefused(f"cannot resume: the robot stands {distance:.2f} m beside its path")
        self._hazards.forget()
        self.stop.tries.forgive()
        self._go_on(job, "resumed")

    def report_accepted(self, jump: AcceptedJump) -> None:
        """Report that the position was moved to that of the receiver or camera, and paint what that leaves open."""
        if self.job is not None:
            self.job.owe_moved(jump.ahead_m)
        text = f"the position was moved by {jump.moved_m:.2f} m to the {self._watch.source}'s"
        if jump.of_receiver:
            self._log.report(WARN, "position-accepted", text)
            return
        cause = f"that has not jumped ({jump.seen_m:.2f} m at most), so the estimate had drifted away"
        self._log.report(WARN, "estimate-diverged", f"{text}; {cause}: calibrate the robot")

    def abort(self, reason: str = ABORTED_BY_OPERATOR) -> None:
        """Abort the traversal.

        Raises:
            CommandRefused: Not in this state.
        """
        require_state(self.state, "abort", READY, RUNNING, PAUSED)
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
        require_state(self.state, "reset", ESTOPPED, DONE, ABORTED)
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
        if self.state == RUNNING or self.stop.ends_by_itself:
            self.pause("the link to the operator is lost", BY_LINK)

    def step(self, tick: int) -> Asking[Command]:
        """Return the command until the next tick; the estimator and the monitors have seen this one."""
        self.clock.tick = tick
        job = self.job
        if job is None:
            return self._computer.command.standstill
        if self.state in (RUNNING, PAUSED):
            self.clock.elapsed_s += TICK_S
        self._heed_hazards(job)
        if self.state == RUNNING:
            return (yield from self._run(job))
        if self.state == ESTOPPED:
            return job.stop_hard()
        command = yield from job.rest()
        if self.stop.ends_by_itself:
            self._try_again(job)
        elif self.stop.lasts:
            self.reason = self._hazards.lasting or f"over: {self.stop.why}; resume to go on"
        return command

    @property
    def nominal(self) -> bool:
        """True if `nominal_tick` can run the next tick, as far as can be seen before it."""
        if self.state != RUNNING or self.reason or self.stop.warns_in(self.clock.tick + 1):
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
        if place is None:
            return None
        return Checkpoint(*place, self.clock.tick, self.clock.elapsed_s, self._fallbacks, self._estimator.learned)

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
            self.stop.pause_now,
        )

    def _heed_hazards(self, job: TraversalJob) -> None:
        hazards = self._hazards
        if hazards.emergency and self.state in (READY, RUNNING, PAUSED):
            self._stop_hard(hazards.emergency)
        elif hazards.stop and self.state == RUNNING:
            job.owe_dry(hazards.findings.dry_s)
            self._halt(hazards.pause, hazards.stop, ERROR)
            self.stop.lasts = hazards.stop == hazards.lasting
        elif hazards.stop and self.stop.ends_by_itself:
            self._halt(hazards.pause, hazards.stop, ERROR)
            self.stop.lasts = hazards.stop == hazards.lasting

    def _stop_hard(self, reason: str) -> None:
        self._before_estop = self.state
        if self.job is not None:
            self.job.close_valve()
        self._become(ESTOPPED, reason, ERROR)

    def _run(self, job: TraversalJob) -> Asking[Command]:
        if self.stop.warns_in(self.clock.tick) and (self._estimator.aligned or not job.aligning):
            self.reason = ABOUT_TO_MOVE
            return (yield from job.rest())
        if (in_the_way := self._protection.watch(job)) and not (job.aligning or job.waiting):
            self._halt(BY_PROTECTION, in_the_way, WARN)
            self._protection.brake()
            return (yield from job.rest())
        step = yield from job.run()
        if step.done:
            self._leave_running(DONE, "")
        elif step.refusal:
            self._leave_running(ABORTED, step.refusal, ERROR)
        elif self._follower.problem:
            job.close_valve(in_s=0.0)
            self._halt(BY_FOLLOWER, self._follower.problem, ERROR)
            return step.command._replace(valve=False, disc=False, valve_after_s=0.0)
        elif step.hold:
            self._halt(BY_LOCALIZATION, step.hold, WARN)
        else:
            if step.waits and not self.reason:
                self._log.report(WARN, "pose-lost", step.waits)
            self.reason = step.waits or _waits_for(job)
            if (job.aligning or job.waiting) and self.stop.too_long(self.clock.tick):
                self._wait_for_person(BY_LOCALIZATION, f"not ready to set off for {self.stop.longest}: {self.reason}")
        return step.command

    def _try_again(self, job: TraversalJob) -> None:
        """End the pause if that can be now."""
        attempt = self.stop.attempt(job)
        self.reason = attempt.reason
        if attempt.person:
            self._wait_for_person(self.stop.pause or BY_LOCALIZATION, attempt.person)
        elif attempt.goes_on:
            self._go_on(job, "")

    def _wait_for_person(self, pause: Pause, reason: str) -> None:
        self._halt(pause._replace(ends_by_itself=False), f"{reason}; resume to go on", ERROR)

    def _set_off(self, reason: str) -> None:
        """Begin to run at standstill."""
        self.stop.since_tick = self.clock.tick
        self._become(RUNNING, "")
        self.stop.warn_of_start(reason)

    def _go_on(self, job: TraversalJob, reason: str) -> None:
        """Continue after a pause: with the present warning, or a new one unless the robot still moves."""
        warning, self.stop.since_tick = self.stop.warning, self.clock.tick
        self._become(RUNNING, "")
        self.stop.warn_again(warning, reason, standing=job.standing)
        job.go_on()

    def _halt(self, by: Pause, reason: str, severity: int = INFO) -> None:
        """Pause, or turn a pause into another one."""
        if self.state == RUNNING:
            self._loaded().close_valve()
            self.stop.since_tick = self.clock.tick
        self._become(PAUSED, reason, severity)
        self.stop.begin(by, reason)

    def _leave_running(self, state: int, reason: str, severity: int = INFO) -> None:
        self._loaded().close_valve()
        self._become(state, reason, severity)

    def _loaded(self) -> TraversalJob:
        assert self.job is not None, "every state but IDLE has a job"
        return self.job

    def _require_standstill(self, command: str) -> None:
        if self.job is not None and not self.job.standing:
            raise CommandRefused(f"cannot {command} while the robot is moving")

    def _become(self, state: int, reason: str, severity: int = INFO) -> None:
        self.state, self.reason = state, reason
        self.stop.clear()
        if state == RUNNING:
            self._protection.let_go()
        elif state != PAUSED:
            self._protection.rest()
        self._log.report(severity, NAMES[state], f"{NAMES[state]}: {reason}" if reason else NAMES[state])


def _waits_for(job: TraversalJob) -> str:
    """Return what a running job that has not set off waits for, "" if it has."""
    if job.waiting:
        return "waiting: the accelerometer contradicts the standing wheels"
    if job.held:
        return "waiting: others are in the way further on"
    return "aligning: standing until the position has settled" if job.aligning else ""
