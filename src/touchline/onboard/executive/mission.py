"""Mission: one loaded trajectory being driven, its phases, paint and progress.

A running job goes through phases: ALIGN (stand until the estimator has settled), ALONG (the plan, leg by leg), and
after a pause BACK: if the place where paint is owed lies behind, the robot reverses along the path, far enough to
regain its speed before the nozzle reaches the place.
"""

from __future__ import annotations

import math
from enum import Enum, auto

from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.control.follower import Asking, Follower
from touchline.onboard.control.path_tracker import STOPPED_MPS, PathTracker, nozzle_m
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.executive.covered import Covered
from touchline.onboard.executive.handover import NotYet, PlanPlace, off_place, taken_over_at
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.executive.sprayer import Sprayer
from touchline.onboard.executive.traversal_job import JobProgress, Step
from touchline.onboard.interface import TICK_S, Checkpoint, Command, PaintBelief
from touchline.onboard.trajectory import path_projection as projection
from touchline.onboard.trajectory.path import FORWARD, SPIN, pose_at
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles import Vehicle

MAX_START_DISTANCE_M = 1.0
MAX_START_HEADING_RAD = math.radians(35.0)
"""Largest heading error at the start; the magnetometer alone is no better, and the run-in corrects it."""
RESUMED_RUN_UP_M = 3.0
"""Run-up of a resumed process: its heading is only the magnetometer's, and driving improves it."""
RUN_UP_SETTLE_M = 1.0
"""Distance beyond what regaining speed needs, so that the nozzle is on its line again. The driving force makes the
tyres slip by a per cent more, which the estimate follows late: it is 1.5 mm ahead after 0.25 m, and right after this
distance."""


class MissionPhase(Enum):
    """Phase of a running job."""

    ALIGN = auto()
    ALONG = auto()
    STOP_TO_GO_BACK = auto()
    BACK = auto()


class Mission:
    """Job along one trajectory.

    Attributes:
        plan, driver, sprayer: The trajectory, the robot's progress along it, and the state of the paint.
    """

    def __init__(
        self,
        plan: LoadedTrajectory,
        vehicle: Vehicle,
        follower: Follower,
        estimator: Estimator,
        watch: LocalizationMonitor,
        computer: ComputerState,
    ) -> None:
        """Begin at the start of a plan, not yet aligned.

        Args:
            plan: The trajectory.
            vehicle: The nominal robot.
            follower: Follower of the path.
            estimator: Estimator of the pose.
            watch: Monitor of the pose.
            computer: State of the computer.
        """
        self.plan = plan
        self.driver = PathTracker(plan, vehicle, follower, computer)
        self.sprayer = Sprayer(plan, vehicle, computer)
        self._covered = Covered(plan) if vehicle.tool.covers else None
        self._vehicle, self._estimator, self._watch = vehicle, estimator, watch
        self._run_up_m = vehicle.tool.work_speed_mps**2 / (2.0 * vehicle.drive.max_acceleration_mps2) + RUN_UP_SETTLE_M
        self._phase = MissionPhase.ALIGN
        self._resumed = False
        self._back_to_m = 0.0
        self._computer, self._command = computer, computer.command
        self._at_rest = False  # stands as commanded: the brakes hold until it is to run

    def resume_at(self, checkpoint: Checkpoint) -> None:
        """Begin at the checkpoint of another process: align there, and go back for owed paint.

        Raises:
            CommandRefused: The checkpoint is no place on this path.
        """
        leg, arc_length_m, owed_from_m = checkpoint[:3]
        if not 0 <= leg < len(self.plan.legs) or not 0.0 <= arc_length_m <= self.plan.total_length_m:
            raise CommandRefused(f"cannot resume at {arc_length_m:.3f} m of leg {leg}: the path has no such place")
        self.driver.resume_at(leg, arc_length_m)
        self.sprayer.resume_at(arc_length_m, owed_from_m)
        self._resumed = True

    def take_over(self, plan: LoadedTrajectory) -> float:
        """Continue on another trajectory without a stop; return the arc length on it at which that happens.

        Raises:
            CommandRefused: Work would be abandoned.
            NotYet: This is not the moment, or that trajectory does not agree with this one.
        """
        if math.isfinite(self.driver.authority_m):
            raise CommandRefused("cannot replace under way: others decide how far the robot may drive; abort first")
        if problem := self._owed_work():
            raise CommandRefused(f"cannot replace under way: the robot {problem}")
        if problem := self._passing_state():
            raise NotYet(f"cannot replace under way: the robot {problem}")
        arc_m = taken_over_at(self._plan_place, plan)
        self.plan = plan
        self.driver.change_plan(plan, arc_m)
        self.sprayer = Sprayer(plan, self._vehicle, self._computer)
        self.sprayer.resume_at(arc_m, None)
        self._covered = Covered(plan) if self._covered is not None else None
        return arc_m

    def _owed_work(self) -> str:
        """Return a text on work that would be abandoned, with the remedy; "" if there is none."""
        owed_m = self.sprayer.owed_if_it_ended(self._nozzle_m())
        if self.sprayer.valve or owed_m is not None:
            return "is painting or owes paint; let it finish, or abort first"
        works = self.plan.works_beyond(self._nozzle_m())
        return "has work to do on its trajectory; let it finish, or abort first" if works else ""

    def _passing_state(self) -> str:
        """Return a text on a state that prevents a change of the trajectory, with the remedy; "" if there is none."""
        if self._phase is not MissionPhase.ALONG:
            return "has not set off yet; send it again once it drives, or abort and load with here"
        if self.driver.leg.sense == SPIN:
            return "turns on the spot; send it again once it drives"
        return "stands; send it again once it drives" if self._at_rest or self.driver.brakes else ""

    @property
    def _plan_place(self) -> PlanPlace:
        return PlanPlace(self.plan, self.driver.leg_index, self.driver.arc_length_m)

    @property
    def place(self) -> tuple[int, float, float | None]:
        """Place from which another process could continue: the first three fields of `Checkpoint`."""
        return self.driver.leg_index, self.driver.arc_length_m, self.sprayer.owed_if_it_ended(self._nozzle_m())

    @property
    def progress(self) -> JobProgress:
        """Progress along the plan."""
        plan, driver = self.plan, self.driver
        segment, arc_m = driver.segment, driver.arc_length_m
        remaining_s = plan.total_time_s - plan.time_at(arc_m, driver.leg_index)
        return JobProgress(segment, len(plan.ids), plan.ids[segment], arc_m, plan.total_length_m, remaining_s)

    @property
    def spraying(self) -> bool:
        """True if the valve is commanded open."""
        return self.sprayer.valve

    @property
    def begins_at(self) -> tuple[float, float, float]:
        """Pose at which the robot is to stand before it sets off: east [m], north [m], heading [rad]."""
        return pose_at(self.plan.path, self.driver.leg, self.driver.arc_length_m)

    @property
    def aligning(self) -> bool:
        """True if the robot has not yet set off."""
        return self._phase is MissionPhase.ALIGN

    @property
    def waiting(self) -> bool:
        """True if the robot is to continue but stands until its accelerometer agrees with the standing wheels."""
        return self._at_rest and self._estimator.disputed

    @property
    def held(self) -> bool:
        """True if the robot has come to the end of its authority on its path."""
        return self._phase is MissionPhase.ALONG and self.driver.held

    @property
    def nominal(self) -> bool:
        """True if nothing has to be decided while it drives on: along the plan, and no paint is owed."""
        driver = self.driver
        along = self._phase is MissionPhase.ALONG and not self._at_rest and not driver.brakes
        return along and driver.leg.sense != SPIN and self.sprayer.owed_from_m is None

    @property
    def standing(self) -> bool:
        """True if the robot is not commanded to move, and its wheels have stood for a while or the estimate is 0."""
        commanded = self.driver.drive.moves_mps(self._command.actuators)
        if commanded >= 2.0 * STOPPED_MPS:
            return False
        known = not self._estimator.started or abs(self._estimator.speed_now_mps()) < 2.0 * STOPPED_MPS
        return known or self._estimator.wheels_stand

    @property
    def lateral_error_m(self) -> float:
        """Estimated distance of the nozzle to the left of its path [m]."""
        return float(self.driver.now[tracking.NOZZLE_LATERAL])

    @property
    def painted(self) -> PaintBelief:
        """Estimated paint or covered ground."""
        if self._covered is not None:
            return self._covered.belief(self.driver.arc_length_m)
        return self.sprayer.belief(self._nozzle_m())

    @property
    def way(self) -> tuple[int, bool]:
        """Leg that the robot is on, and whether it returns along it."""
        return self.driver.leg_index, self._phase is MissionPhase.BACK

    @property
    def returns(self) -> bool:
        """True if the robot, when it goes on after a stop, first returns along its path."""
        return self._run_up_to() is not None

    def lay_way(self, *, back: bool) -> None:
        """Lay the way to come in the computer's state."""
        self.driver.lay_way(back=back)

    @property
    def next_paint_m(self) -> float:
        """Arc length at which work continues after a stop."""
        owed = self.sprayer.owed_from_m
        return owed if owed is not None else self.driver.arc_length_m

    def run(self) -> Asking[Step]:
        """Run one tick of driving and painting."""
        if self.waiting:
            return Step(self._command.standstill)
        self._at_rest = False
        step = yield from self._run()
        self._command.give(step.command)
        return step

    def rest(self) -> Asking[Command]:
        """Run one tick of coming to rest along the path, valve closed; paint that should have been sprayed is owed."""
        return self._command.give((yield from self._rest()))

    def stop_hard(self) -> Command:
        """Run one tick of braking as hard as the wheels can; `locate` finds the resulting place on the path."""
        self.driver.halt()
        return self._command.give(self._command.standstill)

    def close_valve(self, in_s: float = TICK_S) -> None:
        """Close the valve; from where the last drop falls, paint is owed.

        Args:
            in_s: Time at which the command takes effect, counted from the tick that the driver has seen last. Between
                ticks, and before the driver has seen the present one, the last command remains in force for a tick.
        """
        if self._phase is MissionPhase.ALONG:
            self.sprayer.close(self._nozzle_m(in_s), self.driver.speed_mps)

    def owe_dry(self, dry_s: float) -> None:
        """Close the valve, and owe the stretch that was sprayed dry, or too thin, in the last `dry_s` seconds."""
        if self._phase is MissionPhase.ALONG:
            self.sprayer.dry(self._nozzle_m(TICK_S), self.driver.speed_mps, dry_s)

    def owe_moved(self, ahead_m: float) -> None:
        """Owe paint from further back if the position has been moved back: it ended before where it seemed to."""
        self.sprayer.owe_moved(ahead_m)

    def _nozzle_m(self, in_s: float = 0.0) -> float:
        """Return the arc length of the nozzle after a time, as `path_tracker.nozzle_m`."""
        return float(nozzle_m(self._computer.array)) + max(self.driver.speed_mps, 0.0) * in_s

    def locate(self) -> float:
        """Find the standing robot's place on the path anew; return its distance beside the path [m]."""
        self.driver.locate(self._estimator)
        if self._phase is MissionPhase.ALONG:
            self.sprayer.skip(self._nozzle_m(), 0.0)
        return abs(float(self.driver.now[tracking.LATERAL]))

    def go_on(self) -> None:
        """Drive on along the plan; first back, if the place from which paint is owed lies behind."""
        if self._phase is MissionPhase.ALIGN:
            return
        self._phase = MissionPhase.ALONG
        self.sprayer.closed()
        paint_m = self._run_up_to()
        if paint_m is not None:
            run_up_m = max(self._run_up_m, RESUMED_RUN_UP_M if self._resumed else 0.0)
            self._back_to_m = max(paint_m - run_up_m, self.driver.leg.start_m)
            self._phase = MissionPhase.STOP_TO_GO_BACK
        self._resumed = False

    def _run_up_to(self) -> float | None:
        """Return the place of paint that the robot first goes back for; None if it drives on from where it is.

        A resumed process also does so for a line that it would reach before its heading is known.
        """
        nozzle_m, owed_m = self._nozzle_m(), self.sprayer.owed_from_m
        if self._resumed and owed_m is None:
            return self.plan.first_spray_between(nozzle_m, nozzle_m + self._run_up_m)
        return owed_m if self._resumed or self.sprayer.must_go_back(nozzle_m) else None

    def _run(self) -> Asking[Step]:
        if self._phase is MissionPhase.ALIGN:
            if not self._estimator.aligned:
                return Step(self._command.standstill)
            problem = self._start_problem()
            if problem:
                return Step(self._command.standstill, refusal=problem)
            self.driver.halt()
            self._phase = MissionPhase.ALONG
            if self._resumed:
                self.locate()
                self.go_on()
        problem = self._watch.drive_problem()
        if problem:
            return (yield from self._hold(problem))
        if self._phase is MissionPhase.ALONG:
            return (yield from self._along())
        return (yield from self._back())

    def _along(self) -> Asking[Step]:
        driver, sprayer = self.driver, self.sprayer
        actuators = yield from driver.step(self._estimator, projection.MODE_PROFILE)
        place, speed = self._nozzle_m(), driver.speed_mps
        if driver.leg.sense != FORWARD:
            sprayer.pass_by(place)
            if driver.leg_done:
                return (yield from self._leg_done())
            return Step(Command(actuators, False, False))
        problem = self._watch.paint_problem(self.lateral_error_m) if sprayer.due(place, speed) else ""
        valve, valve_after_s = sprayer.step(place, speed, not problem and not driver.held)
        if problem:
            return (yield from self._hold(problem))
        if sprayer.must_go_back(place) and not driver.held:
            self.go_on()
        if driver.leg_done:
            return (yield from self._leg_done())
        return Step(Command(actuators, valve, sprayer.disc_at(place, speed), valve_after_s))

    def _leg_done(self) -> Asking[Step]:
        """End a leg at a cusp or the end, where the robot is almost at rest."""
        self.sprayer.pass_by(self._nozzle_m())
        if not self.driver.next_leg():
            return Step((yield from self._rest()), done=True)
        actuators = yield from self.driver.step(self._estimator, projection.MODE_PROFILE)
        return Step(Command(actuators, False, False))

    def _back(self) -> Asking[Step]:
        """Stop, reverse to the run-up, stop, and drive forward again."""
        if self._phase is MissionPhase.BACK and self.driver.arc_length_m > self._back_to_m + 1e-3:
            actuators = yield from self.driver.step(self._estimator, projection.MODE_BACK, self._back_to_m)
            return Step(Command(actuators, False, False))
        if not self.standing:
            return Step((yield from self._rest()))
        self.driver.halt()
        self._phase = MissionPhase.BACK if self._phase is MissionPhase.STOP_TO_GO_BACK else MissionPhase.ALONG
        return Step(self._command.standstill)

    def _hold(self, problem: str) -> Asking[Step]:
        self.close_valve()
        return Step((yield from self._rest()), hold=problem)

    def _rest(self) -> Asking[Command]:
        driver = self.driver
        if self._phase is MissionPhase.ALIGN or self._at_rest:
            return self._command.standstill
        if driver.still and (self.standing or driver.wheels_rest(self._estimator)):
            driver.halt()
            self._at_rest = True
            return self._command.standstill
        actuators = yield from driver.step(self._estimator, projection.MODE_BRAKE)
        if self._phase is MissionPhase.ALONG:
            self.sprayer.skip(self._nozzle_m(), driver.speed_mps)
        return Command(actuators, False, False)

    def _start_problem(self) -> str:
        distance, turn = off_place(self._plan_place, self._estimator)
        if distance > MAX_START_DISTANCE_M or turn > MAX_START_HEADING_RAD:
            return f"the robot stands {distance:.2f} m and {math.degrees(turn):.0f}° away from where it is to begin"
        return ""
