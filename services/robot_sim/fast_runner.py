"""The fast runner: many nominal ticks in one kernel, for when nobody listens to every tick.

A tick is the one of `Emulator.tick`, made of the same kernels. The loop stops before anything that is not quiet: a
fault that begins or ends, a message that is late, a switch of state, a pose in doubt; the emulator then does that tick
itself. The bits are the same either way.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.arrays import copy
from touchline.services.core.jit import kernel
from touchline.services.onboard import carried as c
from touchline.services.onboard.carry import Cruise
from touchline.services.onboard.computer import Onboard
from touchline.services.onboard.control import PurePursuitFollower
from touchline.services.onboard.control.pure_pursuit import pursue
from touchline.services.onboard.estimation import model
from touchline.services.onboard.nominal_tick import obey, speed_now_mps, steer, take_in
from touchline.services.onboard.trajectory import path_projection
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import ESTIMATED, SENSED, WHOLE, Emulator
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


@kernel
def _read_fix(row: Floats, fix: Floats) -> None:
    fix[c.F_STAMP], fix[c.F_EAST], fix[c.F_NORTH] = row[receiver.STAMP_S], row[receiver.EAST], row[receiver.NORTH]
    fix[c.F_VARIANCE], fix[c.F_FIX] = row[receiver.VARIANCE], row[receiver.FIX]
    fix[c.F_SATELLITES], fix[c.F_AGE] = row[receiver.SATELLITES], row[receiver.CORRECTION_AGE]


@kernel
def _keep(
    row: Floats,
    tick: int,
    state: Floats,
    heard: tuple[Floats, Integers, Floats],
    fixes: int,
    x: Floats,
    P: Floats,
    z: Floats,
    s: Floats,
) -> None:
    readings, _, arrivals = heard
    tick_log.note(row, tick, state, readings, (s[c.COMMAND], s[c.COMMAND + 1]), s[c.COMMAND + 2], s[c.COMMAND + 3])
    pose = row[tick_log.ESTIMATE : tick_log.COVARIANCE]
    pose[0], pose[1], pose[2] = x[model.EAST], x[model.NORTH], x[model.HEADING]
    pose[3], pose[4] = speed_now_mps(x, z, s), x[model.YAW_RATE]
    for i in range(3):
        for j in range(3):
            row[tick_log.COVARIANCE + 3 * i + j] = P[i, j]
    twist = row[tick_log.TWIST_COVARIANCE : tick_log.TRUTH]
    twist[0], twist[1] = P[model.SPEED, model.SPEED], P[model.SPEED, model.YAW_RATE]
    twist[2], twist[3] = P[model.YAW_RATE, model.SPEED], P[model.YAW_RATE, model.YAW_RATE]
    row[tick_log.FIXES] = fixes
    if fixes > 0:
        copy(arrivals[0], row[tick_log.REPORT :])


@kernel
def drive_quietly(
    at: Integers,
    last_tick: int,
    seed: int,
    battery_wh: float,
    effects: Floats,
    world: tuple[Floats, Floats, Floats],
    sensing: Any,
    heard: tuple[Floats, Integers, Floats],
    ring: c.Ring,
    way: c.Way,
    ahead: Floats,
    scratch: tuple[Floats, Floats, Floats, Floats],
    s: Floats,
    k: Floats,
    pursuit: tuple[int, Floats, Floats],
    paint: tuple[Floats, Floats, Integers, Integers, Floats, Floats, Floats, Integers],
    half_width: float,
    track: tuple[Floats, Integers],
    error: Floats,
    rows: Floats,
) -> None:
    """Run ticks until `last_tick` is done, the valve has switched, one is not quiet, or the follower must be asked.

    Args:
        at: (AT,) the tick and its stage; WHOLE or, with the wheel speeds filled in, ASKING to go on from.
        last_tick: To be done.
        seed: Of the scenario.
        battery_wh: Full.
        effects: Of faults; they must not change before `last_tick` is done.
        world: State, parameters and trace.
        sensing: What `sense` is given from the sensors' own.
        heard: Of that the readings, the ticks they were measured in, and the arrivals.
        ring: As of `nominal_tick.take_in`.
        way: As of `nominal_tick.steer`, with `ahead`.
        ahead: See `way`.
        scratch: Saved, flows, fix and wheel speeds.
        s: Of `nominal_tick`, with `k`.
        k: See `s`.
        pursuit: Lead (negative: the follower is asked outside), parameters and memory of `pursue`.
        paint: Table, grid (3), points, latest, stretches and state of the ledger.
        half_width: Of a line.
        track: Rows and count of the `Track`, with room for all these ticks.
        error: Sums of the estimator's error.
        rows: (n, tick_log.COLUMNS) in which the ticks are kept, if n > 0.
    """
    state, parameters, trace = world
    readings, measured_tick, arrivals = heard
    saved, flows, fix, wheels = scratch
    lead, limits, memory = pursuit
    table, frame, starts, members, points, latest, stretches, ledger = paint
    tick = at[TICK]
    while True:
        if at[STAGE] == ASKING:
            switched = s[c.OPEN] != s[c.COMMAND + 2]
            obey(wheels, at[WANTED], way[6][path_projection.SPEED], s, k)
            enter(table, frame, starts, members, half_width, trace, points, latest, stretches, ledger)
            x = ring[0][tick % model.RING]
            truth = (state[body.EAST], state[body.NORTH], state[body.HEADING])
            follow(tick, truth, ledger[projection.STATE_POINTS], *track)
            enter_error(error, state[body.SPEED], truth, (x[model.EAST], x[model.NORTH], x[model.HEADING]))
            at[STAGE] = WHOLE
            if len(rows) > 0:
                slot = tick % model.RING
                row = rows[tick - at[FIRST]]
                _keep(row, tick, state, heard, at[FIXES], ring[0][slot], ring[1][slot], ring[2][slot], s)
            full = ledger[projection.STATE_POINTS] + 2 * projection.MOST_RUNS > len(points)
            if tick >= last_tick or switched or full or ledger[projection.STATE_STRETCHES] > 0:
                return
        tick += 1
        at[TICK] = tick
        left, right = s[c.COMMAND], s[c.COMMAND + 1]
        valve, disc = s[c.COMMAND + 2] > 0.0, s[c.COMMAND + 3] > 0.0
        after_s = s[c.VALVE_AFTER]
        physics.advance(state, parameters, left, right, valve, disc, after_s, effects, seed, tick, trace)
        at[FIXES] = sense(state, effects, seed, tick, *sensing)
        at[STAGE] = SENSED
        if not _arrived_in_time(at[FIXES], tick, measured_tick, arrivals):
            return
        if at[FIXES] > 0:
            _read_fix(arrivals[0], fix)
        if not take_in(tick, readings, at[FIXES], fix, ring, s, k):
            return
        at[STAGE] = ESTIMATED
        battery = state[body.BATTERY_WH] / battery_wh
        at[WANTED] = steer(tick, battery, state[body.TANK_L], ring, way, ahead, saved, flows, s, k)
        if at[WANTED] < 0:
            return
        at[STAGE] = ASKING
        if lead < 0:
            return
        pursue(way[6], ahead, lead, limits, memory, wheels)


class Quiet:
    """Runs an emulator fast; one with another onboard computer than Touchline's own tick by tick."""

    def __init__(self, emulator: Emulator) -> None:
        self._emulator = emulator
        onboard = emulator.onboard
        self._cruise = Cruise(onboard, emulator.vehicle) if isinstance(onboard, Onboard) else None
        self._at: Integers = np.zeros(AT, dtype=np.int64)
        self._fix: Floats = np.zeros(c.FIX_COLUMNS)
        self._wheels: Floats = np.zeros(2)
        self._not_before = 0

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
        if self._cruise is not None:
            self._run_quietly(self._cruise, first + most, rows)
        if emulator.tick_count == first:
            emulator.tick()
        return emulator.tick_count - first

    def _run_quietly(self, cruise: Cruise, last_tick: int, rows: Rows) -> None:
        """Run from the emulator's tick on, to `last_tick` at most; to the end of the first tick that is not quiet."""
        emulator = self._emulator
        first = emulator.tick_count
        last_tick = min(last_tick, emulator.faults.quiet_until)
        effects = emulator.faults.effects
        if first < self._not_before or last_tick <= first or effects[e.BUMPER] > 0.0 or effects[e.OPERATOR_LOST] > 0.0:
            return
        if not cruise.begin(first):
            self._not_before = first + RETRY_TICKS
            return
        self._drive(cruise, last_tick, rows)
        self._hand_over(cruise)

    def _drive(self, cruise: Cruise, last_tick: int, rows: Rows) -> None:
        emulator, at = self._emulator, self._at
        world, sensors, ledger, follower = emulator.world, emulator.sensors, emulator.ledger, cruise.follower
        if type(follower) is PurePursuitFollower:  # one derived from it has a step of its own
            pursuit = (follower.lead, follower.parameters, follower.memory)
        else:
            pursuit = (-1, self._wheels, self._wheels)
        at[TICK], at[STAGE], at[FIRST] = emulator.tick_count, WHOLE, emulator.tick_count + 1
        ledger.make_room()
        arguments = (
            at,
            last_tick,
            emulator.scenario.seed,
            emulator.vehicle.body.battery_wh,
            emulator.faults.effects,
            (world.state, world.parameters, world.trace),
            sensors.arguments,
            sensors.heard,
            cruise.ring,
            cruise.way,
            cruise.ahead,
            (cruise.saved, cruise.flows, self._fix, self._wheels),
            cruise.state,
            cruise.constants,
            pursuit,
            ledger.arrays,
            0.5 * ledger.line_width_m,
            emulator.track.arrays(last_tick - emulator.tick_count),
            emulator.estimator_error.sums,
            rows,
        )
        drive_quietly(*arguments)
        while at[STAGE] == ASKING:
            self._wheels[:] = follower.step(cruise.way[6], cruise.ahead)
            drive_quietly(*arguments)

    def _hand_over(self, cruise: Cruise) -> None:
        """Give everything back, and let the emulator do what is left of the last tick."""
        emulator, (tick, stage, fixes, *_) = self._emulator, self._at.tolist()
        sensed = tick - 1 if stage == SENSED else tick
        emulator.command = cruise.end(tick if stage == WHOLE else tick - 1, sensed=sensed)
        emulator.tick_count = tick
        emulator.ledger.put_aside()
        frame = emulator.sensors.frame(tick, fixes, emulator.world.state, emulator.faults.effects)
        if stage != WHOLE:
            self._not_before = tick + 1
        emulator.end_tick(frame, stage)
