"""Fast runner: many nominal ticks in one kernel, for times when nobody observes every tick.

A tick is the same as in `Emulator.tick`, made of the same kernels. The loop stops before anything that is not nominal:
a fault that begins or ends, a message that is late, a change of state, a doubtful pose; the emulator then does that
tick itself. The bits are the same either way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel, unlocked
from touchline.core.records import Record
from touchline.onboard import filter_model as model
from touchline.onboard.computer import Nominal
from touchline.onboard.computer_state import Computer, ReceivedFix
from touchline.onboard.control import PurePursuitFollower
from touchline.onboard.control.follower import Asking, FollowerInput, answered
from touchline.onboard.control.pure_pursuit import PursuitLimits, PursuitMemory, pursue
from touchline.onboard.estimation.claimed_covariance import claimed_heading_sigma, claimed_position_sigma
from touchline.onboard.estimation.filter_tick import enter_estimate
from touchline.onboard.estimation.report import enter_report
from touchline.onboard.executive.guided_tick import GuidedCourse, guide, stopping_point
from touchline.onboard.interface import SensorFrame
from touchline.onboard.nominal_tick import CourseArrays, actuate, perceive, steer
from touchline.onboard.tracking_state import COMMAND, HEADING_ERROR, NOZZLE_LATERAL, REFERENCE_SPEED
from touchline.schemas.messages import TraversalStatus
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import PERCEIVED, SENSED, WHOLE, Emulator
from touchline.services.robot_sim.estimator_error import enter_error
from touchline.services.robot_sim.paint.projection import MOST_RUNS, PaintArrays, enter
from touchline.services.robot_sim.paint.track import follow
from touchline.services.robot_sim.sensors import position_report as report
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.sampling import Sensing, sense
from touchline.services.robot_sim.sensors.transport import Transport
from touchline.services.robot_sim.tick_log import Rows
from touchline.services.robot_sim.world.effects import FIXED, Effects
from touchline.services.robot_sim.world.objects.things import TOUCHED
from touchline.services.robot_sim.world.physics import HeldCommand, WorldArrays, advance

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

ASKING: Final = 3  # a stage more than the emulator's: the follower is to be called

UNLOGGED: Final[Rows] = np.zeros((0, 0))
"""Rows for ticks that are not logged."""

RUNNING: Final = TraversalStatus.RUNNING
"""State of the traversal in nominal ticks."""

RETRY_TICKS: Final = 10
"""Ticks after one that was not nominal, in which others are likely not to be either."""


class TickProgress(Record):
    """Progress of a tick."""

    tick: int
    stage: int
    """WHOLE, SENSED, PERCEIVED or ASKING."""
    fixes: int
    """Number of fixes that arrived in it."""
    wanted: int
    """Planned actuation."""
    last_tick: int
    """Last tick to be done."""
    first_tick: int
    """Tick of the first row of `TickAccounts.rows`."""


class Hardware(NamedTuple):
    """World and sensors, and the fix for the computer.

    Attributes:
        world: State and constants of the world.
        effects: (1,) effects of faults; they must not change before the last tick is done.
        sensing: State of the sensors.
        fixes: (1,) the fix that arrived, for the computer.
        battery_wh: Charge of the full battery.
    """

    world: WorldArrays
    effects: Sequence[Effects]
    sensing: Sensing
    fixes: Sequence[ReceivedFix]
    battery_wh: float


class Pursuit(NamedTuple):
    """Inputs of `pursue`.

    Attributes:
        lead: Row of the path ahead; negative if another follower is called outside.
        limits: Limits of the follower.
        memory: (1,) memory of the follower.
        twist: (2 + actuators,) answer of this or the other follower; see `nominal_tick.actuate`.
    """

    lead: int
    limits: PursuitLimits
    memory: Sequence[PursuitMemory]
    twist: Floats


class Pilot(NamedTuple):
    """The robot's computer, for kernels.

    Attributes:
        computer: (1,) its state.
        course: Course that it drives.
        pursuit: Its follower.
        saved: (NOW,) scratch.
    """

    computer: Computer
    course: CourseArrays
    pursuit: Pursuit
    saved: Floats


class TickAccounts(NamedTuple):
    """Accounts in which a tick is entered.

    Attributes:
        paint: Arrays of the ledger.
        track: Rows and count of the `Track`, with room for all these ticks.
        error: Sums of the estimator's error.
        rows: (n, tick_log.columns) for the log of the ticks, if n > 0.
    """

    paint: PaintArrays
    track: tuple[Floats, Integers]
    error: Floats
    rows: Floats


@kernel
def _arrived_in_time(fixes: int, tick: int, transport: Sequence[Transport]) -> bool:
    for sensor in range(len(transport[0].measured_tick)):
        if transport[0].measured_tick[sensor] != tick:
            return False
    if fixes == 0:
        return True
    row = transport[0].arrivals[0]
    finite = math.isfinite(row[report.STAMP_S] + row[report.EAST] + row[report.NORTH] + row[report.VARIANCE])
    return fixes == 1 and finite and row[report.FIX] == FIXED


@kernel
def _read_frame(fixes: int, hardware: Hardware, computer: Computer) -> None:
    """Fill in the frame from the received samples and the world's state."""
    frame, state, transport = computer[0].frame, hardware.world.state[0], hardware.sensing.transport[0]
    copy(transport.readings, frame.readings)
    measured = transport.measured_tick
    frame.imu_tick, frame.mag_tick, frame.encoder_tick = measured[0], measured[1], measured[2]
    frame.battery_fraction, frame.tank_l = state.battery_wh / hardware.battery_wh, state.tank_l
    frame.bumper, frame.operator_alive = False, True
    if fixes == 0:
        return
    row, fix = transport.arrivals[0], hardware.fixes[0]
    fix.stamp_s, fix.east_m, fix.north_m = row[report.STAMP_S], row[report.EAST], row[report.NORTH]
    fix.variance_m2, fix.fix = row[report.VARIANCE], int(row[report.FIX])
    fix.satellites, fix.correction_age_s = int(row[report.SATELLITES]), row[report.CORRECTION_AGE]
    fix.heading_rad, fix.heading_variance_rad2 = row[report.HEADING], row[report.HEADING_VARIANCE]


@kernel
def _held(computer: Computer) -> HeldCommand:
    """Return the command in force."""
    command = computer[0].command
    return HeldCommand(command.actuators, command.valve, command.disc, command.valve_after_s)


@kernel
def _keep(row: Floats, progress: Sequence[TickProgress], hardware: Hardware, computer: Computer) -> None:
    """Log a tick in a row."""
    tick, fixes, transport = progress[0].tick, progress[0].fixes, hardware.sensing.transport[0]
    tick_log.note(row, tick, hardware.world.state, transport.readings, _held(computer))
    enter_estimate(computer, row[tick_log.ESTIMATE : tick_log.TRUTH])
    if tick % tick_log.ESTIMATOR_TICKS == 0:
        enter_report(
            computer[0].filter.counters,
            claimed_position_sigma(computer[0]),
            claimed_heading_sigma(computer[0]),
            row[tick_log.CONSISTENCY : tick_log.ELAPSED_S],
        )
    leg, at = computer[0].leg, tick_log.PROGRESS
    row[at], row[at + 1], row[at + 2] = leg.arc_m, leg.now[NOZZLE_LATERAL], leg.now[HEADING_ERROR]
    row[at + 3], row[at + 4] = leg.now[REFERENCE_SPEED], RUNNING
    row[tick_log.FIXES] = fixes
    if fixes > 0:
        copy(transport.arrivals[0], row[tick_log.REPORT :])


@kernel
def _keep_guided(row: Floats, tick: int, computer: Computer, course: GuidedCourse) -> None:
    """Log the data of a tick that only a guided robot publishes."""
    row[tick_log.ELAPSED_S] = computer[0].clock.elapsed_s
    if tick % tick_log.WHEREABOUTS_TICKS == 0:
        stop = stopping_point(computer, course)
        row[tick_log.STOP], row[tick_log.STOP + 1] = stop.real, stop.imag


@kernel
def _enter(progress: Sequence[TickProgress], hardware: Hardware, computer: Computer, accounts: TickAccounts) -> None:
    """Enter a completed tick in the accounts."""
    state, tick = hardware.world.state[0], progress[0].tick
    enter(hardware.world.trace, accounts.paint)
    x = computer[0].filter.states[tick % model.RING]
    truth = (state.east_m, state.north_m, state.heading_rad)
    follow(tick, truth, accounts.paint.coverage.state[0].points, *accounts.track)
    enter_error(accounts.error, state.speed_mps, truth, (x[model.EAST], x[model.NORTH], x[model.HEADING]))
    if len(accounts.rows) > 0:
        _keep(accounts.rows[tick - progress[0].first_tick], progress, hardware, computer)


@kernel
def _perceive(progress: Sequence[TickProgress], hardware: Hardware, computer: Computer, course: Any) -> bool:
    """Run the next tick up to the decision of the robot's computer; return False if it is not nominal so far."""
    at, tick = progress[0], progress[0].tick + 1
    world, effects, sensing, fixes, _ = hardware
    at.tick = tick
    advance(world, _held(computer), effects, tick)
    at.fixes = sense(Moment(world.state, effects, world.seed, tick), sensing)
    at.stage = SENSED
    if world.things.marks[TOUCHED]:
        return False
    if not _arrived_in_time(at.fixes, tick, sensing.transport):
        return False
    _read_frame(at.fixes, hardware, computer)
    perceive(tick, fixes, at.fixes, computer, course)
    at.stage = PERCEIVED
    return True


@unlocked
def run_guided_ticks(
    progress: Sequence[TickProgress],
    hardware: Hardware,
    computer: Computer,
    course: GuidedCourse,
    accounts: TickAccounts,
) -> None:
    """Run ticks of a guided robot until the last is done or one is not nominal.

    Args:
        progress: (1,) updated.
        hardware: World and sensors, updated.
        computer: (1,) state of the computer, updated.
        course: Present guidance.
        accounts: Accounts in which each tick is entered.
    """
    at, ledger = progress[0], accounts.paint.coverage.state[0]
    while at.tick < at.last_tick:
        if not _perceive(progress, hardware, computer, course) or not guide(computer, course):
            return
        _enter(progress, hardware, computer, accounts)
        if len(accounts.rows) > 0:
            _keep_guided(accounts.rows[at.tick - at.first_tick], at.tick, computer, course)
        at.stage = WHOLE
        if ledger.points + 2 * MOST_RUNS > len(accounts.paint.points) or ledger.stretches > 0:
            return


@unlocked
def run_nominal_ticks(
    progress: Sequence[TickProgress], hardware: Hardware, pilot: Pilot, accounts: TickAccounts
) -> None:
    """Run ticks until the last is done, the valve has switched, one is not nominal, or the follower must be called.

    Args:
        progress: (1,) updated; its stage is WHOLE or, with the follower's answer filled in, ASKING to continue from.
        hardware: World and sensors, updated.
        pilot: Computer and follower, updated.
        accounts: Accounts in which each tick is entered.
    """
    at, ledger = progress[0], accounts.paint.coverage.state[0]
    computer, course, pursuit, saved = pilot
    lead, limits, memory, twist = pursuit
    points, ahead = accounts.paint.points, course.leg.ahead
    while True:
        if at.stage == ASKING:
            switched = actuate(twist, at.wanted, computer, course)
            _enter(progress, hardware, computer, accounts)
            at.stage = WHOLE
            full = ledger.points + 2 * MOST_RUNS > len(points)
            if at.tick >= at.last_tick or switched or full or ledger.stretches > 0:
                return
        if not _perceive(progress, hardware, computer, course):
            return
        at.wanted = steer(computer, course, saved)
        if at.wanted < 0:
            return
        at.stage = ASKING
        if lead < 0:
            return
        pursue(computer[0].leg.now, ahead, lead, limits, memory, twist)


class FastRunner:
    """Runner of an emulator."""

    def __init__(self, emulator: Emulator) -> None:
        self._emulator = emulator
        self._progress = TickProgress()
        self._fix = ReceivedFix.row(1)
        count = len(emulator.vehicle.drive.actuators)
        self._twist: Floats = np.full(2 + count, np.nan)
        self._saved: Floats = np.zeros(COMMAND + count)
        self._not_before = 0
        self._code: Callable[..., None] | None = None  # `run_nominal_ticks` for the types of its arguments
        self._guided_code: Callable[..., None] | None = None

    def run(self, most: int) -> None:
        """Run up to that many ticks, no more than the traversal takes, without reading their messages.

        The result is the same as of as many calls of `Emulator.tick`, several times as fast.
        """
        emulator = self._emulator
        last = emulator.tick_count + most
        while emulator.tick_count < last and emulator.active:
            self.step(last - emulator.tick_count, UNLOGGED)

    def step(self, most: int, rows: Rows) -> int:
        """Run 1 to `most` ticks: nominal ones, and at the end perhaps one that is not.

        Args:
            most: Largest number of ticks.
            rows: (`most`, tick_log.columns) filled with the log of the nominal ticks, or none at all.

        Returns:
            Number of ticks.
        """
        return answered(self.asking_step(most, rows), self._emulator.onboard.follower)

    def asking_step(self, most: int, rows: Rows) -> Asking[int]:
        """As `step`; the caller answers instead of the follower.

        In a nominal tick it may also run the kernel `run_nominal_ticks` itself, with the `arguments` that it gets, as
        often as their progress remains at ASKING, and then answers None.
        """
        emulator = self._emulator
        first = emulator.tick_count
        yield from self._run_nominal(first + most, rows)
        if emulator.tick_count == first:
            yield from emulator.asking_tick()
        return emulator.tick_count - first

    def _run_nominal(self, last_tick: int, rows: Rows) -> Asking[None]:
        """Run from the emulator's tick to `last_tick` at most; to the end of the first tick that is not nominal."""
        emulator, onboard = self._emulator, self._emulator.onboard
        first = emulator.tick_count
        emulator.hand_over_samples()
        last_tick = min(last_tick, emulator.faults.unchanged_until, emulator.auxiliary.next_tick)
        effects = emulator.faults.effects
        if first < self._not_before or last_tick <= first or effects.bumper or effects.operator_lost:
            return
        if (guided := onboard.guided_course(first)) is not None:
            self._drive_guided(onboard.computer, guided, last_tick, rows)
        elif (nominal := onboard.nominal(first)) is not None:
            yield from self._drive(nominal, last_tick, rows)
        else:
            self._not_before = first + RETRY_TICKS
            return
        yield from self._hand_over()

    def _drive_guided(self, computer: Computer, course: GuidedCourse, last_tick: int, rows: Rows) -> None:
        arguments = self._progress.array, self._hardware(last_tick), computer, course, self._accounts(last_tick, rows)
        if self._guided_code is None:
            self._guided_code = run_guided_ticks.for_types_of(arguments)
        self._guided_code(*arguments)

    def _hardware(self, last_tick: int) -> Hardware:
        """Return the robot's hardware, ready for ticks up to the last."""
        emulator, progress, first = self._emulator, self._progress, self._emulator.tick_count
        progress.tick, progress.first_tick, progress.last_tick, progress.stage = first, first + 1, last_tick, WHOLE
        effects, battery_wh = emulator.faults.effects.array, emulator.vehicle.body.battery_wh
        return Hardware(emulator.world.arrays, effects, emulator.sensors.sensing, self._fix, battery_wh)

    def _accounts(self, last_tick: int, rows: Rows) -> TickAccounts:
        """Return the accounts for ticks up to the last."""
        emulator = self._emulator
        emulator.work.ledger.make_room()
        track = emulator.work.track.arrays(last_tick - emulator.tick_count)
        return TickAccounts(emulator.work.ledger.paint, track, emulator.work.estimator_error.sums, rows)

    def _drive(self, nominal: Nominal, last_tick: int, rows: Rows) -> Asking[None]:
        progress, follower = self._progress, nominal.follower
        inner = follower.inner
        if type(inner) is PurePursuitFollower:  # one derived from it has a step of its own
            pursuit = Pursuit(inner.lead, inner.limits, inner.memory.array, self._twist)
        else:
            pursuit = Pursuit(-1, PursuitLimits(0.0, 0.0, 0.0), PursuitMemory().array, self._twist)
        hardware = self._hardware(last_tick)
        pilot = Pilot(nominal.computer, nominal.course, pursuit, self._saved)
        arguments = (progress.array, hardware, pilot, self._accounts(last_tick, rows))
        if self._code is None:
            self._code = run_nominal_ticks.for_types_of(arguments)
        run = self._code
        run(*arguments)
        asked = FollowerInput(nominal.now, nominal.course.leg.ahead, arguments)
        while progress.stage == ASKING:
            answer = yield asked
            if answer is None:
                continue
            speed_mps, yaw_rate_radps, actuators = answer
            self._twist[:2], self._twist[2:] = (speed_mps, yaw_rate_radps), actuators or np.nan
            if follower.problem:
                progress.last_tick = progress.tick  # the present tick: the next one is decided
            run(*arguments)

    def frame(self, tick: int) -> SensorFrame:
        """Return the sensor frame of the present tick, also of one in which the follower is asked."""
        emulator = self._emulator
        if emulator.frame is not None and emulator.frame.tick == tick:
            return emulator.frame
        fixes = self._progress.fixes
        return emulator.sensors.frame(tick, fixes, emulator.world.state, emulator.faults.effects)

    def _hand_over(self) -> Asking[None]:
        """Return everything to the emulator, which does the rest of the last tick."""
        emulator, progress = self._emulator, self._progress
        tick, stage = progress.tick, progress.stage
        emulator.command = emulator.onboard.driven(tick if stage == WHOLE else tick - 1)
        emulator.tick_count = tick
        emulator.work.ledger.put_aside()
        if stage == WHOLE:
            emulator.sense_auxiliary()
        else:
            self._not_before = tick + 1
            yield from emulator.end_tick(self.frame(tick), stage)
