"""The emulated robot, one 10 ms tick at a time: world → sensors → onboard computer → paint.

Nothing here reads wall time, files or the bus: the same vehicle, scenario and commands at the same ticks give the same
session to the bit, whatever the pace.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from touchline.onboard import Onboard
from touchline.onboard.control import Ask, nobody
from touchline.onboard.control.follower import Asking, answered
from touchline.onboard.executive.stop_causes import (
    ABORTED_BY_OPERATOR,
    BY_SHUT_DOWN,
    BY_WATCHDOG,
    EMERGENCY_STOP,
)
from touchline.onboard.interface import (
    TICKS_PER_S,
    AuxiliarySample,
    Checkpoint,
    OnboardEvent,
    SensorFrame,
    standstill,
)
from touchline.onboard.trajectory.trajectory import resume_pose
from touchline.schemas.errors import CommandRefused
from touchline.schemas.faults import BatteryLow, Fault, TankEmpty
from touchline.schemas.known_ground import Ring
from touchline.schemas.messages import Event, Guidance, Trajectory, TraversalStatus, WayRound
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.accounting.area_account import area_account
from touchline.services.robot_sim.contact_account import contact_event
from touchline.services.robot_sim.estimator_error import NO_ERROR
from touchline.services.robot_sim.fault_timeline import FaultTimeline
from touchline.services.robot_sim.initial_state import InitialState, RobotParts
from touchline.services.robot_sim.loaded_job import LoadedJob, Taking, ledger_of, lines_and_start, place_of
from touchline.services.robot_sim.order_log import OrderLog
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.receiver_check import check_receiver
from touchline.services.robot_sim.recovery_state import EarlierWork, Totals, restored_json
from touchline.services.robot_sim.sensors.auxiliary_truth import AuxiliaryTruth
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.sampling import stand_by
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.settling import RESTING_MPS, Settling
from touchline.services.robot_sim.solid_outlines import solid_outlines
from touchline.services.robot_sim.true_vehicle import true_vehicle
from touchline.services.robot_sim.work_accounts import WorkAccounts
from touchline.services.robot_sim.world.world import TruePose, World

UNDER_WAY: Final = (TraversalStatus.RUNNING, TraversalStatus.PAUSED)

# Stage of a tick that was begun elsewhere.
WHOLE: Final = 0  # all is done
SENSED: Final = 1  # the onboard computer has not seen it
PERCEIVED: Final = 2  # the onboard computer has seen it, and has yet to decide


class Emulator:
    """One emulated robot.

    Args:
        vehicle: The nominal robot, as its computer and others are told; `true_vehicle` makes the real one of it.
        scenario: World of the robot, and its deviations from the nominal robot.
        config: Configuration of the robot's computer; default: the shipped robot's.
        onboard: The robot's computer; default: Touchline's own.
        ask: Function that calls an external follower, if the configuration names one.

    Attributes:
        tick_count: Ticks so far; sim time is a hundredth of it in seconds.
        real: The vehicle as it really is.
        world, sensors, auxiliary, faults, onboard: The parts.
        samples: Samples of auxiliary sensors that arrived in the last tick; the computer takes them before the next
            one.
        orders: Commands that were carried out.
        work: Accounts of the loaded traversal.
        settling: Observation of the traversal after its end.
        frame: Sensor frame of the last tick of which all or the end was done here.
        command: Command of the computer in the last tick.
        initial: State in which the present job was given; None if the robot had just been switched on, or if the job
            was taken over under way.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        scenario: Scenario,
        config: OnboardConfig | None = None,
        onboard: Onboard | None = None,
        ask: Ask = nobody,
    ) -> None:
        self.vehicle, self.scenario, self.config = vehicle, scenario, config or OnboardConfig()
        check_receiver(vehicle, scenario, self.config)
        self.real = true_vehicle(vehicle, scenario.truth)
        self.world = World(self.real, scenario)
        self.sensors = Sensors(self.real, scenario)
        self.auxiliary = AuxiliaryTruth(self.real, scenario, self.world.surroundings)
        self.samples: tuple[AuxiliarySample, ...] = ()
        self.faults = FaultTimeline(scenario.faults, vehicle.drive)
        self.onboard = onboard if onboard is not None else Onboard(vehicle, self.config, ask)
        self.work = self._no_paint()
        self.orders = OrderLog()
        self.initial: InitialState | None = None
        self.tick_count = 0
        self._used = False
        self.frame: SensorFrame | None = None
        self.command = standstill(len(vehicle.drive.actuators))
        self.settling = Settling()
        self._events: list[OnboardEvent] = []
        self._way_round: WayRound | None = None
        if scenario.start is not None:
            self.world.place(TruePose(scenario.start.x_m, scenario.start.y_m, scenario.start.heading_rad))

    def _no_paint(self) -> WorkAccounts:
        """Make the accounts of a job without lines."""
        return WorkAccounts(PaintLedger([], self.vehicle.tool.width_m, self.vehicle.tool.width_m))

    @property
    def time_s(self) -> float:
        """Sim time."""
        return self.tick_count / TICKS_PER_S

    @property
    def active(self) -> bool:
        """True if a traversal is under way or has not yet come to rest."""
        return self.onboard.state in UNDER_WAY or self.settling.observes

    @property
    def settled(self) -> bool:
        """True if the observation of an ended traversal ended with the last tick: its figures are final."""
        return self.settling.just_over

    def load(
        self,
        trajectory: Trajectory,
        template: Template | None = None,
        resume: Checkpoint | None = None,
        earlier: EarlierWork | None = None,
        taking: Taking = Taking.CARRIED,
    ) -> float:
        """Prepare and take a trajectory, with the arguments of `prepare`.

        Returns:
            Planned duration [s].

        Raises:
            CommandRefused: It cannot be driven, or not now.
        """
        if taking is not Taking.UNDER_WAY:
            self.check_load()
        return self.take(self.prepare(trajectory, template, resume, earlier, taking))

    def check_load(self) -> None:
        """Check that a trajectory would be accepted now.

        Raises:
            CommandRefused: A traversal is under way or coming to rest.
        """
        if self.active and self.onboard.state not in UNDER_WAY:
            raise CommandRefused("the last traversal is still coming to rest; load again in a second of sim time")
        self.onboard.check_load()

    def prepare(
        self,
        trajectory: Trajectory,
        template: Template | None = None,
        resume: Checkpoint | None = None,
        earlier: EarlierWork | None = None,
        taking: Taking = Taking.CARRIED,
        cause: PlanCause | None = None,
    ) -> LoadedJob:
        """Check a trajectory and its lines to be painted without changing anything, so any thread may do it meanwhile.

        Args:
            trajectory: Path, speeds and actuation.
            template: Template to evaluate the work by; None: the trajectory itself.
            resume: Checkpoint to continue at; None: the start.
            earlier: Earlier work of the job that continues.
            taking: Way to get to the start.
            cause: Request that the plan was made from, if known.

        Raises:
            CommandRefused: The trajectory cannot be driven.
        """
        wanted, start = lines_and_start(trajectory, template, self.vehicle, cause.left_out if cause is not None else ())
        boundary = template.boundary.corners if template is not None and template.boundary is not None else ()
        known: Sequence[Ring] = ()
        if template is not None:
            known = [obstacle.corners for obstacle in template.obstacles]
        elif cause is not None:
            known = solid_outlines(cause.known)
        course = self.onboard.prepare(trajectory, boundary, known)
        if resume is not None:
            start = resume_pose(trajectory, self.vehicle, resume)
        ledger = ledger_of(wanted, template, self.vehicle.tool)
        if earlier is not None:
            ledger.restore(earlier.paint, place_of(self.real.tool.point_m, start))
        account = area_account(template, trajectory, self.vehicle)
        obstacles = template.obstacles if template is not None else ()
        return LoadedJob(course, start, ledger, account, resume, earlier, taking, cause, obstacles)

    def take(self, job: LoadedJob) -> float:
        """Take a prepared job; return its planned duration [s].

        The robot is carried to the scenario's start or else to where the plan begins, unless it stands there already or
        continues from another job, and a new ledger is opened. A job that is resumed stands where another process
        stopped, sim time continues from then, and only the rest is painted. With its earlier work it also has no more
        paint and charge than the robot had then; the figures are those of the whole job.

        Raises:
            CommandRefused: A traversal is under way or coming to rest, or it cannot be resumed or begun there; or it
                does not agree with the one that it is to replace.
        """
        resume, earlier = job.resume, job.earlier
        self.hand_over_samples()
        put = job.taking is Taking.CARRIED and (self.scenario.start is None or resume is not None)
        if job.taking is Taking.CARRIED and resume is None:
            self.world.surroundings.check_room(job.start if put else self.world.pose[:3], job.obstacles)
        initial = self._state() if job.taking is not Taking.UNDER_WAY else None
        duration_s = self._hand_to_onboard(job)
        self.initial = initial
        cause = job.cause.model_dump(mode="json") if job.cause is not None else None
        restored = restored_json(resume, earlier) if resume is not None else {}
        self._note("load", plan=cause, taking=job.taking.name.lower(), resumed=resume is not None, **restored)
        self.work = WorkAccounts(job.ledger, job.account, earlier.totals.errors if earlier is not None else NO_ERROR)
        self.world.surroundings.surround(job.obstacles)
        if earlier is not None:
            self.world.supply(earlier.totals.supplies)
        if put:
            self.world.place(TruePose(*job.start))
        if resume is not None and resume.tick > self.tick_count:
            self._stand_by(resume.tick)
        return duration_s

    def _state(self) -> InitialState | None:
        """Return the state in which the next job begins; None if the robot is new, as its setup says."""
        if not self.tick_count and not self.orders.count and not self._used:
            return None
        return InitialState.of(self._parts, self.tick_count, self.orders.count, self.command)

    def begin_with(self, supplies: tuple[float, float, float, float]) -> None:
        """Set paint and charge to those of another process's robot, as in `World.supplies`; before anything else."""
        self.world.supply(supplies)
        self._used = True

    def restore(self, state: InitialState) -> None:
        """Restore the state in which a robot was given a job; call it before anything else.

        Raises:
            DamagedState: It is not the state of such a robot.
        """
        state.restore(self._parts)
        self.tick_count, self.command, self.orders.count = state.tick, state.command, state.orders

    @property
    def _parts(self) -> RobotParts:
        return RobotParts(self.world, self.sensors, self.auxiliary, self.faults, self.onboard)

    def _hand_to_onboard(self, job: LoadedJob) -> float:
        if job.taking is Taking.UNDER_WAY:
            return self.onboard.take_over(job.course)
        self.check_load()
        return (
            self.onboard.take_here(job.course)
            if job.taking is Taking.HERE
            else self.onboard.take(job.course, job.resume)
        )

    def _stand_by(self, tick: int) -> None:
        """Advance to where another process ended: satellites, sensors and faults have progressed meanwhile."""
        first = Moment(self.world.state.array, self.world.no_effects.array, self.scenario.seed, self.tick_count + 1)
        stand_by(first, tick, self.sensors.sensing)
        self.tick_count = tick
        self.samples = ()
        self.auxiliary.restore((), tick)
        self.faults.step(tick)

    def begin_guided(self, *, plans: bool = False, margin_m: float = 0.0) -> None:
        """Follow a team coordinator's guidance from now on.

        Args:
            plans: Whether guidance has plans instead of cells.
            margin_m: Distance by which the robot may be off its guidance; 0: any.

        Raises:
            CommandRefused: Not now, or not such a robot.
        """
        self.check_load()
        self.hand_over_samples()
        initial = self._state()
        self.onboard.begin_guided(plans=plans, margin_m=margin_m)
        self.initial = initial
        told = {"plans": True} if plans else {}
        self._note("begin-guided", **told, **({"margin_m": margin_m} if margin_m else {}))
        self.work = self._no_paint()
        self.world.surroundings.surround(())
        self.settling.begin()

    def forget_cell(self) -> None:
        """Brake straight ahead until another coordinator sends a cell."""
        self.onboard.forget_cell()
        self._note("forget-cell")

    def take_guidance(self, guidance: Guidance) -> None:
        """Take guidance from the coordinator; do nothing if it cannot be used, or the robot is not guided."""
        if self.onboard.take_guidance(guidance):
            self._note("guidance", **guidance.model_dump(mode="json"))

    def start(self) -> None:
        """Begin the loaded traversal."""
        self.onboard.start()
        self._note("start")
        self.settling.begin()

    def pause(self) -> None:
        """Brake with the valve closed."""
        self.onboard.pause()
        self._note("pause")

    def fail_safe(self, missed_s: float) -> None:
        """Pause because the control loop has missed its turns for some seconds of wall-clock time."""
        self.onboard.pause(f"the control loop did not turn for {missed_s:.2f} s; resume to go on", BY_WATCHDOG)
        self._note("watchdog", missed_s=missed_s)

    def shut_down(self) -> None:
        """Pause because the process is about to end."""
        self.onboard.pause("the robot is switched off", BY_SHUT_DOWN)
        self._note("shut-down")

    def resume(self) -> None:
        """Continue after a pause.

        A robot that pauses looks for its place on the path, and may accept that of the receiver, before it can refuse:
        that it was asked is noted, too.

        Raises:
            CommandRefused: Not now, or the cause of the pause persists.
        """
        pauses = self.onboard.state == TraversalStatus.PAUSED
        try:
            self.onboard.resume()
        except CommandRefused:
            if pauses:
                self._note("resume", refused=True)
            raise
        self._note("resume")

    def abort(self, reason: str = ABORTED_BY_OPERATOR) -> None:
        """Brake and abort the traversal."""
        self.onboard.abort(reason)
        self._note("abort", reason=reason)

    def estop(self, reason: str = EMERGENCY_STOP) -> None:
        """Stop at once; only a reset releases the robot."""
        self.onboard.estop(reason)
        self._note("estop", reason=reason)

    def reset(self) -> None:
        """Release an emergency stop."""
        self.onboard.reset()
        self._note("reset")

    def authorize(self, until_m: float) -> None:
        """Allow driving up to this arc length only [m], which later calls may extend."""
        self.onboard.authorize(until_m)
        self._note("authorize", until_m=until_m if math.isfinite(until_m) else None)

    def refill_tank(self) -> tuple[float, float]:
        """Fill the tank; return the paint in it before and after [l].

        Raises:
            CommandRefused: The robot drives, or has no tank.
        """
        if not self.vehicle.tool.capacity_l:
            raise CommandRefused("cannot refill the tank: the vehicle has none")
        self._require_rest("refill the tank")
        before_l = self.world.supplies[0]
        self.world.refill_tank()
        self.faults.mend(TankEmpty, self.tick_count)
        self._note("refill-tank")
        return before_l, self.world.supplies[0]

    def replace_battery(self) -> tuple[float, float]:
        """Replace the battery by a full one; return the charge before and after [Wh].

        Raises:
            CommandRefused: The robot drives.
        """
        self._require_rest("replace the battery")
        before_wh = self.world.supplies[1]
        self.world.replace_battery()
        self.faults.mend(BatteryLow, self.tick_count)
        self._note("replace-battery")
        return before_wh, self.world.supplies[1]

    def _require_rest(self, command: str) -> None:
        if self.onboard.state == TraversalStatus.RUNNING:
            raise CommandRefused(f"cannot {command} while the robot drives; pause it first")
        if abs(self.world.state.speed_mps) > RESTING_MPS:
            raise CommandRefused(f"cannot {command} while the robot is moving; wait until it stands")

    def link_lost(self) -> None:
        """Pause because no operator who could stop the robot is there any more."""
        self.onboard.link_lost()
        self._note("link-lost")

    def inject_fault(self, fault: Fault) -> None:
        """Inject a fault, from the next tick on or `start_s` later.

        Raises:
            CommandRefused: There are too many faults already.
        """
        self.faults.inject(fault, self.tick_count)
        self._note("inject-fault", fault=fault.model_dump(mode="json", exclude_none=True))

    def note_way_round(self, said: WayRound, warning: str = "") -> None:
        """Note what the robot does about things in its way, for others to know.

        Args:
            said: The report; its header is filled in when it is sent.
            warning: Text for the operator; "" for none.
        """
        self._way_round = said
        if warning:
            self._events.append(OnboardEvent(Event.WARN, "way-round", warning))
        self._note("way-round", said=said.model_dump(mode="json", exclude={"header"}), warning=warning)

    def take_way_round(self) -> WayRound | None:
        """Return and clear the last report about things in the way; None if there is no new one."""
        said, self._way_round = self._way_round, None
        return said

    def _note(self, name: str, **details: Any) -> None:
        self.orders.note(self.tick_count, name, **details)

    def take_events(self) -> list[OnboardEvent]:
        """Return and clear the events: faults that began and ended, contacts and ways round, the onboard computer's."""
        own, self._events = self._events, []
        return self.faults.take_events() + own + self.onboard.take_events()

    def tick(self) -> None:
        """Run one tick of 10 ms."""
        answered(self.asking_tick(), self.onboard.follower)

    def asking_tick(self) -> Asking[None]:
        """Run one tick; the caller answers instead of the follower."""
        self.hand_over_samples()
        self.tick_count += 1
        self.faults.step(self.tick_count)
        self.world.step(self.command, self.tick_count, self.faults.effects)
        frame = self.sensors.read(self.tick_count, self.world.state, self.faults.effects)
        yield from self.end_tick(frame, SENSED)

    def hand_over_samples(self) -> None:
        """Pass the samples that arrived of auxiliary sensors in the last tick to the onboard computer, once."""
        if self.samples:
            self.onboard.take_samples(self.samples)
            self.samples = ()

    def sense_auxiliary(self) -> None:
        """Let auxiliary sensors measure at the end of this tick."""
        self.samples = self.auxiliary.step(self.tick_count, self.world.state, self.faults.effects)

    def end_tick(self, frame: SensorFrame, stage: int) -> Asking[None]:
        """End a tick of which a part was done elsewhere.

        Args:
            frame: Sensor frame of the tick.
            stage: SENSED or PERCEIVED: the part that is done.
        """
        self.frame = frame
        for contact in self.world.surroundings.new_contacts(frame.tick):
            self.work.contacts.append(contact)
            self._events.append(contact_event(contact))
        if stage == SENSED:
            self.onboard.perceive(frame)
        self.command = yield from self.onboard.decide(frame.tick)
        self._follow_up()

    @property
    def setup(self) -> Setup:
        """The robot and its world."""
        return Setup(vehicle=self.vehicle, onboard=self.config, scenario=self.scenario)

    @property
    def totals(self) -> Totals:
        """Consumption and sums of the loaded traversal."""
        return Totals(self.world.supplies, self.work.estimator_error.totals, self.work.ledger.settled)

    def _follow_up(self) -> None:
        under_way = self.onboard.state in UNDER_WAY
        self.work.record(self.tick_count, self.world, self.onboard.estimate if under_way else None)
        self.sense_auxiliary()
        self.settling.end_tick(self.world.state.speed_mps, under_way=under_way)
