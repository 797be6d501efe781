"""The fast runner: many nominal ticks in one kernel, for when nobody listens to every tick.

A tick is the one of `Emulator.tick`, made of the same kernels. The loop stops before anything that is not quiet: a
fault that begins or ends, a message that is late, a switch of state, a pose in doubt; the emulator then does that tick
itself. The bits are the same either way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.arrays import copy
from touchline.services.core.jit import kernel
from touchline.services.onboard import filter_model as model
from touchline.services.onboard.computer import Nominal, Onboard
from touchline.services.onboard.computer_state import Computer
from touchline.services.onboard.control import PurePursuitFollower
from touchline.services.onboard.control.pure_pursuit import PursuitLimits, pursue
from touchline.services.onboard.estimation.filter import speed_now_mps
from touchline.services.onboard.interface import (
    F_AGE,
    F_EAST,
    F_FIX,
    F_NORTH,
    F_SATELLITES,
    F_STAMP,
    F_VARIANCE,
    FIX_COLUMNS,
)
from touchline.services.onboard.nominal_tick import CourseArrays, actuate, perceive, steer
from touchline.services.onboard.tracking_state import NOW
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import PERCEIVED, SENSED, WHOLE, Emulator
from touchline.services.robot_sim.estimator_error import enter_error
from touchline.services.robot_sim.paint import projection
from touchline.services.robot_sim.paint.projection import enter
from touchline.services.robot_sim.paint.track import follow
from touchline.services.robot_sim.sensors import receiver
from touchline.services.robot_sim.sensors.sampling import sense
from touchline.services.robot_sim.tick_log import Rows
from touchline.services.robot_sim.world import body, physics
from touchline.services.robot_sim.world import effects as e

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Where a tick stands, in `Quiet.at`.
TICK: Final = 0
STAGE: Final = 1
FIXES: Final = 2  # that arrived in it
WANTED: Final = 3  # actuation
FIRST: Final = 4  # tick of the first row of `rows`
AT: Final = 5

ASKING: Final = 3  # a stage more than the emulator's: the follower is to be asked

_NO_ROWS: Final[Rows] = np.zeros((0, tick_log.COLUMNS))

RETRY_TICKS: Final = 10
"""After a tick that was not quiet, the next ones are not likely to be."""


@kernel
def _arrived_in_time(fixes: int, tick: int, measured_tick: Integers, arrivals: Floats) -> bool:
    for sensor in range(3):
        if measured_tick[sensor] != tick:
            return False
    if fixes == 0:
        return True
    row = arrivals[0]
    finite = math.isfinite(row[receiver.STAMP_S] + row[receiver.EAST] + row[receiver.NORTH] + row[receiver.VARIANCE])
    return fixes == 1 and finite and row[receiver.FIX] == receiver.FIXED


class Hearing(NamedTuple):
    """What the sensors leave, and the frame that it becomes.

    Attributes:
        sensing: What `sense` is given from the sensors' own.
        readings: (interface.READINGS,) newest samples.
        measured_tick: (3,) ticks in which they were measured.
        arrivals: (ARRIVALS, receiver.COLUMNS) reports of the receiver.
        fixes: (1, FIX_COLUMNS) the one that arrived, for the computer.
        battery_wh: Full.
    """

    sensing: Any
    readings: Floats
    measured_tick: Integers
    arrivals: Floats
    fixes: Floats
    battery_wh: float


class Pursuit(NamedTuple):
    """What `pursue` is given.

    Attributes:
        lead: Row of the path ahead; negative if another follower is asked outside.
        limits: That it keeps to.
        memory: Of the follower.
        twist: (2,) what it, or the other, answers.
    """

    lead: int
    limits: PursuitLimits
    memory: Floats
    twist: Floats


class Books(NamedTuple):
    """Where a tick is entered.

    Attributes:
        paint: Table, grid (3), points, latest, stretches and state of the ledger.
        half_width_m: Of a line.
        track: Rows and count of the `Track`, with room for all these ticks.
        error: Sums of the estimator's error.
        rows: (n, tick_log.COLUMNS) in which the ticks are kept, if n > 0.
    """

    paint: tuple[Floats, Floats, Integers, Integers, Floats, Floats, Floats, Integers]
    half_width_m: float
    track: tuple[Floats, Integers]
    error: Floats
    rows: Floats


@kernel
def _read_frame(state: Floats, fixes: int, hearing: Hearing, computer: Computer) -> None:
    """Fill in the frame from the sensors' arrays and the world's state."""
    frame = computer[0].frame
    copy(hearing.readings, frame.readings)
    copy(hearing.measured_tick, frame.measured_tick)
    frame.battery_fraction, frame.tank_l = state[body.BATTERY_WH] / hearing.battery_wh, state[body.TANK_L]
    frame.bumper, frame.operator_alive = False, True
    if fixes == 0:
        return
    row, fix = hearing.arrivals[0], hearing.fixes[0]
    fix[F_STAMP], fix[F_EAST], fix[F_NORTH] = row[receiver.STAMP_S], row[receiver.EAST], row[receiver.NORTH]
    fix[F_VARIANCE], fix[F_FIX] = row[receiver.VARIANCE], row[receiver.FIX]
    fix[F_SATELLITES], fix[F_AGE] = row[receiver.SATELLITES], row[receiver.CORRECTION_AGE]


@kernel
def _keep(row: Floats, tick: int, state: Floats, hearing: Hearing, fixes: int, computer: Computer) -> None:
    """Keep a tick in a row of the log."""
    command, slot = computer[0].command, tick % model.RING
    valve, disc = 1.0 if command.valve else 0.0, 1.0 if command.disc else 0.0
    tick_log.note(row, tick, state, hearing.readings, command.actuators, valve, disc)
    x, P = computer[0].filter.states[slot], computer[0].filter.covariances[slot]
    pose = row[tick_log.ESTIMATE : tick_log.COVARIANCE]
    pose[0], pose[1], pose[2] = x[model.EAST], x[model.NORTH], x[model.HEADING]
    pose[3], pose[4] = speed_now_mps(computer), x[model.YAW_RATE]
    for i in range(3):
        for j in range(3):
            row[tick_log.COVARIANCE + 3 * i + j] = P[i, j]
    twist = row[tick_log.TWIST_COVARIANCE : tick_log.TRUTH]
    twist[0], twist[1] = P[model.SPEED, model.SPEED], P[model.SPEED, model.YAW_RATE]
    twist[2], twist[3] = P[model.YAW_RATE, model.SPEED], P[model.YAW_RATE, model.YAW_RATE]
    row[tick_log.FIXES] = fixes
    if fixes > 0:
        copy(hearing.arrivals[0], row[tick_log.REPORT :])


@kernel
def _enter(
    at: Integers, world: tuple[Floats, Floats, Floats], hearing: Hearing, computer: Computer, books: Books
) -> None:
    """Enter a tick that is done in the books."""
    state, _, trace = world
    tick = at[TICK]
    table, frame, starts, members, points, latest, stretches, ledger = books.paint
    enter(table, frame, starts, members, books.half_width_m, trace, points, latest, stretches, ledger)
    x = computer[0].filter.states[tick % model.RING]
    truth = (state[body.EAST], state[body.NORTH], state[body.HEADING])
    follow(tick, truth, ledger[projection.STATE_POINTS], *books.track)
    enter_error(books.error, state[body.SPEED], truth, (x[model.EAST], x[model.NORTH], x[model.HEADING]))
    if len(books.rows) > 0:
        _keep(books.rows[tick - at[FIRST]], tick, state, hearing, at[FIXES], computer)


@kernel
def drive_quietly(
    at: Integers,
    last_tick: int,
    seed: int,
    effects: Floats,
    world: tuple[Floats, Floats, Floats],
    hearing: Hearing,
    computer: Computer,
    course: CourseArrays,
    pursuit: Pursuit,
    books: Books,
    saved: Floats,
) -> None:
    """Run ticks until `last_tick` is done, the valve has switched, one is not quiet, or the follower must be asked.

    Args:
        at: (AT,) the tick and its stage; WHOLE or, with the follower's answer filled in, ASKING to go on from.
        last_tick: To be done.
        seed: Of the scenario.
        effects: Of faults; they must not change before `last_tick` is done.
        world: State, parameters and trace.
        hearing: Of the sensors.
        computer: The robot's.
        course: That it drives.
        pursuit: Its follower.
        books: In which each tick is entered.
        saved: (NOW,) scratch.
    """
    state, parameters, trace = world
    sensing, _, measured_tick, arrivals, fixes, _ = hearing
    lead, limits, memory, twist = pursuit
    ledger, points, ahead = books.paint[7], books.paint[4], course.leg.ahead
    tick = at[TICK]
    while True:
        if at[STAGE] == ASKING:
            switched = actuate(twist, at[WANTED], computer, course)
            _enter(at, world, hearing, computer, books)
            at[STAGE] = WHOLE
            full = ledger[projection.STATE_POINTS] + 2 * projection.MOST_RUNS > len(points)
            if tick >= last_tick or switched or full or ledger[projection.STATE_STRETCHES] > 0:
                return
        tick += 1
        at[TICK] = tick
        command = computer[0].command
        left, right, valve, disc = command.actuators[0], command.actuators[1], command.valve, command.disc
        physics.advance(state, parameters, left, right, valve, disc, command.valve_after_s, effects, seed, tick, trace)
        at[FIXES] = sense(state, effects, seed, tick, *sensing)
        at[STAGE] = SENSED
        if not _arrived_in_time(at[FIXES], tick, measured_tick, arrivals):
            return
        _read_frame(state, at[FIXES], hearing, computer)
        perceive(tick, fixes, at[FIXES], computer, course)
        at[STAGE] = PERCEIVED
        at[WANTED] = steer(computer, course, saved)
        if at[WANTED] < 0:
            return
        at[STAGE] = ASKING
        if lead < 0:
            return
        pursue(computer[0].leg.now, ahead, lead, limits, memory, twist)


class Quiet:
    """Runs an emulator fast; one with another onboard computer than Touchline's own tick by tick."""

    def __init__(self, emulator: Emulator) -> None:
        self._emulator = emulator
        self._onboard = emulator.onboard if isinstance(emulator.onboard, Onboard) else None
        self._at: Integers = np.zeros(AT, dtype=np.int64)
        self._fix: Floats = np.zeros((1, FIX_COLUMNS))
        self._twist: Floats = np.zeros(2)
        self._saved: Floats = np.zeros(NOW)
        self._not_before = 0
        self._code: Callable[..., None] | None = (
            None  # of `drive_quietly`, whose arguments are always of the same types
        )

    def run(self, most: int) -> None:
        """Let up to that many ticks pass, no more than the traversal takes; what they had to say is not looked at.

        It is what as many calls of `Emulator.tick` would do, several times as fast.
        """
        emulator = self._emulator
        last = emulator.tick_count + most
        while emulator.tick_count < last and emulator.active:
            self.step(last - emulator.tick_count, _NO_ROWS)

    def step(self, most: int, rows: Rows) -> int:
        """Let 1 to `most` ticks pass: quiet ones, and at the end perhaps one that is not; returns how many.

        The quiet ones are kept in `rows`, (`most`, tick_log.COLUMNS) or none at all; the last one need not be.
        """
        emulator = self._emulator
        first = emulator.tick_count
        if self._onboard is not None:
            self._run_quietly(self._onboard, first + most, rows)
        if emulator.tick_count == first:
            emulator.tick()
        return emulator.tick_count - first

    def _run_quietly(self, onboard: Onboard, last_tick: int, rows: Rows) -> None:
        """Run from the emulator's tick on, to `last_tick` at most; to the end of the first tick that is not quiet."""
        emulator = self._emulator
        first = emulator.tick_count
        last_tick = min(last_tick, emulator.faults.quiet_until)
        effects = emulator.faults.effects
        if first < self._not_before or last_tick <= first or effects[e.BUMPER] > 0.0 or effects[e.OPERATOR_LOST] > 0.0:
            return
        nominal = onboard.nominal(first)
        if nominal is None:
            self._not_before = first + RETRY_TICKS
            return
        self._drive(nominal, last_tick, rows)
        self._hand_over(onboard)

    def _drive(self, nominal: Nominal, last_tick: int, rows: Rows) -> None:
        emulator, at = self._emulator, self._at
        world, sensors, ledger, follower = emulator.world, emulator.sensors, emulator.ledger, nominal.follower
        if type(follower) is PurePursuitFollower:  # one derived from it has a step of its own
            pursuit = Pursuit(follower.lead, follower.limits, follower.memory, self._twist)
        else:
            pursuit = Pursuit(-1, PursuitLimits(0.0, 0.0, 0.0), self._twist, self._twist)
        at[TICK], at[STAGE], at[FIRST] = emulator.tick_count, WHOLE, emulator.tick_count + 1
        ledger.make_room()
        arguments = (
            at,
            last_tick,
            emulator.scenario.seed,
            emulator.faults.effects,
            (world.state, world.parameters, world.trace),
            Hearing(sensors.arguments, *sensors.heard, self._fix, emulator.vehicle.body.battery_wh),
            nominal.computer,
            nominal.course,
            pursuit,
            Books(
                ledger.arrays,
                0.5 * ledger.line_width_m,
                emulator.track.arrays(last_tick - emulator.tick_count),
                emulator.estimator_error.sums,
                rows,
            ),
            self._saved,
        )
        if self._code is None:
            self._code = drive_quietly.for_types_of(arguments)
        drive = self._code
        drive(*arguments)
        now, ahead = nominal.now, nominal.course.leg.ahead
        while at[STAGE] == ASKING:
            self._twist[:] = follower.step(now, ahead)
            drive(*arguments)

    def _hand_over(self, onboard: Onboard) -> None:
        """Give everything back, and let the emulator do what is left of the last tick."""
        emulator, (tick, stage, fixes, *_) = self._emulator, self._at.tolist()
        emulator.command = onboard.driven(tick if stage == WHOLE else tick - 1)
        emulator.tick_count = tick
        emulator.ledger.put_aside()
        frame = emulator.sensors.frame(tick, fixes, emulator.world.state, emulator.faults.effects)
        if stage != WHOLE:
            self._not_before = tick + 1
        emulator.end_tick(frame, stage)
