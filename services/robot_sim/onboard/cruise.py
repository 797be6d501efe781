"""The onboard computer's quiet ticks as kernels: driving along a leg with nothing to decide.

Nearly all ticks of a session are alike: samples arrive in time, the pose is good, no hazard is in sight, the robot
follows its leg and the valve does what the plan says. `take_in` and `steer` do such a tick on plain arrays, with the
arithmetic of `Intake`, `Estimator`, `Watch`, `Hazards`, `Job`, `Driver` and `Sprayer` in the same order, so the bits
are the same. As soon as a tick is not quiet they stop, having changed nothing that those do not expect, and the objects
take over. `Cruise` carries the state across.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from schemas.messages import Actuation, TraversalStatus
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S, Command, GnssSample, ImuSample
from services.robot_sim.onboard import hazards as h
from services.robot_sim.onboard import safety
from services.robot_sim.onboard import tracking as t
from services.robot_sim.onboard.driver import END_TOLERANCE_M, observe
from services.robot_sim.onboard.estimator import model as m
from services.robot_sim.onboard.estimator.filter import FIX_FIXED, LEAD_S
from services.robot_sim.onboard.estimator.intake import FROZEN_RADPS, MAG_EVERY_TICKS, STILL_RAD, STILL_TICKS
from services.robot_sim.onboard.estimator.kernels import advance, take_fix
from services.robot_sim.onboard.fence import beyond_m
from services.robot_sim.onboard.followers import Follower
from services.robot_sim.onboard.followers.external import ExternalFollower
from services.robot_sim.onboard.job import Phase
from services.robot_sim.onboard.onboard import Onboard
from services.robot_sim.onboard.path import FORWARD
from services.robot_sim.onboard.tracking import track

_VALVE, _DISC = Actuation.VALVE, Actuation.DISC

Floats = NDArray[np.float64]
Ring = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]
Way = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]

# What is carried across, `Cruise.state`.
STILL: Final = 0  # Intake
ACCEL: Final = 1
RATE: Final = 2  # left, right
ANGLE: Final = 4  # left, right
FIX: Final = 6  # the last fix, as `GnssSample`
LAST_USED: Final = 13
FIRST_TICK: Final = 14
EXPECTED: Final = 15  # Hazards: left, right
TANK: Final = 17
FLOW_SUM: Final = 18
FLOW_VALVE: Final = 19
FLOW_TICKS: Final = 20
FLOW_COUNT: Final = 21
FLOW_FIRST: Final = 22  # in the ring of flows
ELAPSED: Final = 23  # Traversal
COMMAND: Final = 24  # left, right [rad/s], valve, disc
VALVE_AFTER: Final = 28  # the command's valve_after_s
SPRAYED_TO: Final = 29  # Sprayer
FALLS_FROM: Final = 30
FALLS_TO: Final = 31
SWITCH: Final = 32  # index of the actuation under the robot
OPEN: Final = 33  # whether the valve is to be open by the end of the coming tick
SWITCH_AT: Final = 34  # where the nozzle is when it has to change
NOZZLE_AT: Final = 35  # where the nozzle is, as `Job` has it
READING: Final = 36  # Intake: the newest IMU sample, gyro and accelerometer
RATE_THEN: Final = 42  # left, right, when it was last another one
STATE_SIZE: Final = 44

# Constants, `Cruise.constants`.
K_RADIUS: Final = 0
K_LAG: Final = 1
K_MAX_STEP: Final = 2
K_NOMINAL_L: Final = 3
K_SETTLE_TICKS: Final = 4
K_FENCE_MARGIN: Final = 5
K_BODY_RADIUS: Final = 6
K_LEG_END: Final = 7
K_VALVE_ON: Final = 8  # delays [s]
K_VALVE_OFF: Final = 9
CONSTANTS: Final = 10

# Columns of a fix in `FIX`, and of what `take_in` is given.
F_STAMP: Final = 0
F_EAST: Final = 1
F_NORTH: Final = 2
F_VARIANCE: Final = 3
F_FIX: Final = 4
F_SATELLITES: Final = 5
F_AGE: Final = 6
FIX_COLUMNS: Final = 7


@kernel
def _frozen(samples: Floats, s: Floats) -> bool:
    """Whether the IMU repeats itself while the wheels change their rates."""
    for axis in range(6):
        if samples[axis] != s[READING + axis]:
            return False
    change = max(abs(s[RATE] - s[RATE_THEN]), abs(s[RATE + 1] - s[RATE_THEN + 1]))
    frozen: bool = change > FROZEN_RADPS
    return frozen


@kernel
def _remember(samples: Floats, s: Floats) -> None:
    new = False
    for axis in range(6):
        if samples[axis] != s[READING + axis]:
            new = True
            s[READING + axis] = samples[axis]
    if new:
        s[RATE_THEN], s[RATE_THEN + 1] = s[RATE], s[RATE + 1]


@kernel
def _take_samples(tick: int, samples: Floats, inputs: Floats, s: Floats, k: Floats) -> None:
    """As `Intake.take`, for samples of this tick that follow on those of the last one."""
    row = inputs[tick % m.RING]
    for column in range(m.INPUTS):
        row[column] = math.nan
    _remember(samples, s)
    row[m.IN_GYRO] = samples[2]
    row[m.IN_ACCEL] = 0.5 * (samples[3] + s[ACCEL])
    row[m.IN_SIDE] = samples[4]
    s[ACCEL] = samples[3]
    still = True
    for wheel in range(2):
        turned = samples[9 + wheel] - s[ANGLE + wheel]
        s[ANGLE + wheel] = samples[9 + wheel]
        s[RATE + wheel] = turned / TICK_S
        still = still and abs(turned) < STILL_RAD
    s[STILL] = s[STILL] + 1.0 if still else 0.0
    row[m.IN_LEFT] = s[RATE] * k[K_RADIUS]
    row[m.IN_RIGHT] = s[RATE + 1] * k[K_RADIUS]
    row[m.IN_SPAN] = 1.0
    row[m.IN_STILL] = 1.0 if s[STILL] >= STILL_TICKS else 0.0
    if tick % MAG_EVERY_TICKS == 0:
        row[m.IN_MAG] = math.atan2(samples[6], samples[7])


@kernel
def take_in(tick: int, samples: Floats, fixes: int, fix: Floats, ring: Ring, s: Floats, k: Floats) -> bool:
    """As `Estimator.step`, for samples in time and at most one fix, which is an RTK-fixed one.

    Args:
        tick: This tick.
        samples: (11,) gyro, accelerometer, magnetometer (3 each), wheel angles (2), as in a `SensorFrame`.
        fixes: 1 if a fix arrived, else 0.
        fix: (FIX_COLUMNS,) it.
        ring: States, covariances, inputs, fixes, figures and counters of the filter, and what it learns beside.
        s: (STATE_SIZE,) updated.
        k: (CONSTANTS,).

    Returns:
        False if the samples are not to be trusted; then nothing has been done.
    """
    if _frozen(samples, s):
        return False
    xs, covariances, inputs, entered, c, n, slow = ring
    _take_samples(tick, samples, inputs, s, k)
    if fixes > 0 and fix[F_STAMP] > s[FIX + F_STAMP] and fix[F_STAMP] <= tick / 100 + LEAD_S:
        for column in range(FIX_COLUMNS):
            s[FIX + column] = fix[column]
    advance(xs, covariances, inputs, entered, c, n, slow, tick, tick, tick)
    if fixes == 0:
        return True
    valid = math.floor(fix[F_STAMP] / TICK_S + 1e-6)
    row = entered[m.RING]
    row[m.FIX_EAST], row[m.FIX_NORTH] = fix[F_EAST], fix[F_NORTH]
    row[m.FIX_AFTER] = fix[F_STAMP] - valid * TICK_S
    row[m.FIX_VARIANCE] = c[m.C_R_GNSS] + max(fix[F_VARIANCE] - c[m.C_R_GNSS] - c[m.C_GM_VAR], 0.0)
    used = n[m.N_FIXES]
    take_fix(xs, covariances, inputs, entered, c, n, tick, int(s[FIRST_TICK]), valid)
    if n[m.N_FIXES] > used:
        s[LAST_USED] = max(s[LAST_USED], fix[F_STAMP])
    return True


@kernel
def _trusted(tick: int, P: Floats, n: Floats, s: Floats) -> bool:
    """Whether `Watch` finds nothing wrong with the pose."""
    now_s = tick / 100
    fix = s[FIX : FIX + FIX_COLUMNS]
    fresh = fix[F_AGE] <= safety.MAX_CORRECTION_AGE_S and now_s - fix[F_STAMP] <= safety.MAX_FIX_AGE_S
    used = n[m.N_FIX_REJECTED_RUN] < safety.MAX_REJECTED_RUN and now_s - s[LAST_USED] <= safety.MAX_FIX_AGE_S
    consistent = n[m.NIS_FIX_RECENT] <= safety.MAX_NIS and n[m.ENCODER_REJECTED_RECENT] <= safety.MAX_SLIP
    sigma = math.sqrt(max(P[m.EAST, m.EAST], P[m.NORTH, m.NORTH]))
    known = sigma <= safety.MAX_POSITION_SIGMA_M and sigma <= safety.MAX_BLIND_SIGMA_M
    return fix[F_FIX] == FIX_FIXED and fresh and used and consistent and known


@kernel
def _unharmed(
    x: Floats,
    sigma_rad: float,
    battery: float,
    tank_l: float,
    fence: Floats,
    shape: Floats,
    flows: Floats,
    s: Floats,
    k: Floats,
) -> bool:
    """As `Hazards.look`, if it finds nothing; else nothing is changed."""
    if battery < h.LOW_BATTERY or tank_l <= h.DRY_TANK_L or tank_l < h.LOW_TANK_L:
        return False
    doubt_m = h.HEADING_DOUBT * sigma_rad * k[K_BODY_RADIUS]
    if beyond_m(fence, shape, k[K_BODY_RADIUS], x[m.EAST], x[m.NORTH], x[m.HEADING]) > k[K_FENCE_MARGIN] + doubt_m:
        return False
    left = s[EXPECTED] + min(max(k[K_LAG] * (s[COMMAND] - s[EXPECTED]), -k[K_MAX_STEP]), k[K_MAX_STEP])
    right = s[EXPECTED + 1] + min(max(k[K_LAG] * (s[COMMAND + 1] - s[EXPECTED + 1]), -k[K_MAX_STEP]), k[K_MAX_STEP])
    if abs(s[RATE] - left) > max(h.WHEEL_TOLERANCE_RADPS, h.WHEEL_TOLERANCE * abs(left)):
        return False
    if abs(s[RATE + 1] - right) > max(h.WHEEL_TOLERANCE_RADPS, h.WHEEL_TOLERANCE * abs(right)):
        return False

    used_l, valve = s[TANK] - tank_l, s[COMMAND + 2]
    total, ticks, count, first = s[FLOW_SUM], s[FLOW_TICKS], int(s[FLOW_COUNT]), int(s[FLOW_FIRST])
    if valve != s[FLOW_VALVE] or not abs(used_l) < h.REFILL_L:
        total, ticks, count, first = 0.0, 0.0, 0, 0
    ticks += 1.0
    if ticks > k[K_SETTLE_TICKS]:
        if count == h.FLOW_WINDOW_TICKS:
            total -= flows[first]
        total += used_l
        filled = min(count + 1, h.FLOW_WINDOW_TICKS)
        if filled == h.FLOW_WINDOW_TICKS:
            share = total / (h.FLOW_WINDOW_TICKS * k[K_NOMINAL_L])
            if (valve > 0.0 and share < h.DRY_SHARE) or (valve == 0.0 and share > h.LEAK_SHARE):
                return False
        flows[(first + count) % h.FLOW_WINDOW_TICKS] = used_l
        if count == h.FLOW_WINDOW_TICKS:
            first = (first + 1) % h.FLOW_WINDOW_TICKS
        count = filled
    elif count == h.FLOW_WINDOW_TICKS:
        return False
    s[EXPECTED], s[EXPECTED + 1] = left, right
    s[TANK], s[FLOW_VALVE] = tank_l, valve
    s[FLOW_SUM], s[FLOW_TICKS], s[FLOW_COUNT], s[FLOW_FIRST] = total, ticks, float(count), float(first)
    return True


@kernel
def _wanted(arc_m: float, ahead_m: float, switch_m: Floats, actuation: Floats, s: Floats) -> int:
    """As `Sprayer.wanted_at`, what the plan asks for at either place; and as `Sprayer.step` while nothing is owed."""
    at = int(s[SWITCH])
    while at >= 0 and switch_m[at] > arc_m:  # the nozzle goes back a little when a standing robot turns
        at -= 1
    while at + 1 < len(switch_m) and switch_m[at + 1] <= arc_m:
        at += 1
    s[SWITCH] = at
    now = int(actuation[at]) if at >= 0 else 0
    next_m = switch_m[at + 1] if at + 1 < len(switch_m) else math.inf
    while at + 1 < len(switch_m) and switch_m[at + 1] <= ahead_m:
        at += 1
    then = int(actuation[at]) if at >= 0 else 0
    sprays, is_open = now & _VALVE != 0, s[COMMAND + 2] > 0.0
    s[OPEN], s[SWITCH_AT] = 1.0 if (now | then) & _VALVE else 0.0, arc_m
    if sprays == is_open and (then & _VALVE != 0) != sprays:
        s[OPEN], s[SWITCH_AT] = 0.0 if is_open else 1.0, next_m
    return now | then


@kernel
def speed_now_mps(x: Floats, s: Floats) -> float:
    """As `Estimator.speed_now_mps`."""
    speed_mps: float = x[m.SPEED] + 0.5 * TICK_S * (s[ACCEL] - x[m.ACCEL_BIAS])
    return speed_mps


@kernel
def steer(
    tick: int,
    battery: float,
    tank_l: float,
    ring: Ring,
    way: Way,
    ahead: Floats,
    saved: Floats,
    flows: Floats,
    s: Floats,
    k: Floats,
) -> int:
    """As `Watch`, `Hazards` and `Job` in a quiet tick, up to what the follower is told.

    Args:
        tick: This tick, which `take_in` has seen.
        battery: State of charge, 0…1.
        tank_l: Level of the tank.
        ring: As in `take_in`.
        way: Rows of the leg, speeds, switches, actuation, the driver's progress, limits, now and body, the fence and
            the body's shape.
        ahead: Of the driver.
        saved: (PROGRESS + NOW,) scratch.
        flows: (FLOW_WINDOW_TICKS,) ring of what left the tank.
        s: (STATE_SIZE,).
        k: (CONSTANTS,).

    Returns:
        The actuation for the coming tick; −1 if the tick is not quiet, then only the estimator has had it.
    """
    rows, speeds, switch_m, actuation, progress, limits, now, body, fence, shape = way
    x, P = ring[0][tick % m.RING], ring[1][tick % m.RING]
    if not _trusted(tick, P, ring[5], s):
        return -1
    saved[: t.PROGRESS] = progress
    saved[t.PROGRESS :] = now
    limits[t.L_BACK_TO] = 0.0
    observe(x, speed_now_mps(x, s), s[COMMAND], s[COMMAND + 1], body, now)
    track(rows, FORWARD, speeds, progress, limits, t.MODE_PROFILE, x[m.EAST], x[m.NORTH], x[m.HEADING], now, ahead)
    arc, speed = progress[t.P_ARC], now[t.SPEED]
    s[NOZZLE_AT] = arc - limits[t.L_NOZZLE_Y] * now[t.HEADING_ERROR]
    wanted: int = _wanted(s[NOZZLE_AT], s[NOZZLE_AT] + TICK_S * max(speed, 0.0), switch_m, actuation, s)
    astray = abs(now[t.NOZZLE_LATERAL]) > safety.MAX_LATERAL_M
    sigma_rad = math.sqrt(P[m.HEADING, m.HEADING])
    doubtful = sigma_rad > safety.MAX_HEADING_SIGMA_RAD
    arrived = arc >= k[K_LEG_END] - END_TOLERANCE_M and abs(speed) < 2.0 * t.CREEP_MPS
    well = not arrived and not ((astray or doubtful) and wanted & _VALVE)
    if not well or not _unharmed(x, sigma_rad, battery, tank_l, fence, shape, flows, s, k):
        progress[:] = saved[: t.PROGRESS]
        now[:] = saved[t.PROGRESS :]
        return -1
    return wanted


@kernel
def obey(wheels: Floats, wanted: int, speed_mps: float, s: Floats, k: Floats) -> None:
    """End a quiet tick with the follower's wheel speeds (2,) [rad/s] and the plan's actuation."""
    s[COMMAND], s[COMMAND + 1] = wheels[0], wheels[1]
    s[VALVE_AFTER] = 0.0
    if s[OPEN] != s[COMMAND + 2]:
        speed_mps, place_m = max(speed_mps, 0.0), s[SWITCH_AT]
        if place_m > s[NOZZLE_AT]:
            s[VALVE_AFTER] = min((place_m - s[NOZZLE_AT]) / speed_mps, TICK_S)
        if s[OPEN] > 0.0:
            s[FALLS_FROM], s[FALLS_TO] = place_m + speed_mps * k[K_VALVE_ON], math.inf
        else:
            s[FALLS_TO] = place_m + speed_mps * k[K_VALVE_OFF]
    s[COMMAND + 2] = s[OPEN]
    s[COMMAND + 3] = 1.0 if wanted & _DISC else 0.0
    s[SPRAYED_TO] = s[NOZZLE_AT]
    s[ELAPSED] += TICK_S


class Cruise:
    """Carries the state of an `Onboard` into the kernels and back; it knows that room's insides.

    Attributes:
        state, constants, flows, saved, ring, way, ahead: What the kernels are given; valid after `begin`.
    """

    def __init__(self, onboard: Onboard, vehicle: Vehicle) -> None:
        """For this computer, whatever it has loaded."""
        self._onboard = onboard
        self._traversal, self._watch, self._hazards = onboard._traversal, onboard._watch, onboard._hazards
        self._estimator, self._intake = onboard._estimator, onboard._estimator.intake
        estimator = self._estimator
        self.ring: Ring = (
            estimator._xs,
            estimator._covariances,
            estimator._inputs,
            estimator._fixes,
            estimator._c,
            estimator.counters,
            estimator._slow,
        )
        self.state = np.zeros(STATE_SIZE)
        self.constants = np.zeros(CONSTANTS)
        self.flows = np.zeros(h.FLOW_WINDOW_TICKS)
        self.saved = np.zeros(t.PROGRESS + t.NOW)
        self.ahead = np.zeros((0, t.AHEAD_COLUMNS))
        self.way: Way = (*(np.zeros((0, 0)),) * 2, *(np.zeros(0),) * 6, *(np.zeros((0, 2)),) * 2)
        hazards, k = self._hazards, self.constants
        k[K_RADIUS] = vehicle.wheel_radius_m
        k[K_LAG], k[K_MAX_STEP], k[K_NOMINAL_L] = hazards._lag, hazards._max_step, hazards._nominal_l
        k[K_SETTLE_TICKS] = hazards._settle_ticks
        k[K_VALVE_ON], k[K_VALVE_OFF] = vehicle.valve_on_delay_s, vehicle.valve_off_delay_s

    @property
    def follower(self) -> Follower:
        """What is asked between `steer` and `obey`."""
        return self._onboard._follower

    def begin(self, tick: int) -> bool:
        """Take over after `tick`, if nothing is the matter."""
        job, estimator, hazards, intake = self._traversal.job, self._estimator, self._hazards, self._intake
        fix, fence = estimator.last_fix, hazards.fence
        if (
            job is None
            or fix is None
            or fence is None
            or intake._reading is None
            or self._traversal.state != TraversalStatus.RUNNING
            or self._traversal.reason
        ):
            return False
        driver, sprayer, plan = job.driver, job.sprayer, job.plan
        along = job._phase is Phase.ALONG and driver.leg.sense == FORWARD and sprayer.owed_from_m is None
        worried = self._watch.pose_problem or hazards.emergency or hazards.stop or any(hazards._wheel_s)
        away = hazards._outside_s > 0.0 or hazards._unheard_s > 0.0 or hazards.dry_s > 0.0
        asked = isinstance(self.follower, ExternalFollower)  # which can fail in any tick
        if not along or worried or away or asked or not intake.imu_tick == intake.encoder_tick == tick:
            return False
        s, k = self.state, self.constants
        s[STILL], s[ACCEL], s[RATE : RATE + 2] = intake.still_ticks, intake.accel_mps2, intake.encoder_rates
        s[ANGLE], s[ANGLE + 1] = intake._left_rad, intake._right_rad
        s[READING : READING + 6], s[RATE_THEN : RATE_THEN + 2] = intake._reading, intake._rates_then
        s[FIX : FIX + FIX_COLUMNS] = fix
        s[LAST_USED], s[FIRST_TICK] = estimator.last_used_stamp_s, estimator._first_tick
        s[EXPECTED : EXPECTED + 2] = hazards._expected
        s[TANK], s[FLOW_SUM], s[FLOW_VALVE] = hazards._tank_l, hazards._flow_sum_l, hazards._valve
        s[FLOW_TICKS], s[FLOW_COUNT], s[FLOW_FIRST] = hazards._valve_ticks, len(hazards._flow), 0
        self.flows[: len(hazards._flow)] = hazards._flow
        s[ELAPSED], s[COMMAND : VALVE_AFTER + 1] = self._traversal._elapsed_s, self._onboard._command
        s[SPRAYED_TO], s[FALLS_FROM], s[FALLS_TO] = sprayer._last_m, sprayer.falls_from_m, sprayer.falls_to_m
        s[SWITCH] = bisect_right(plan.switch_m, sprayer._last_m) - 1
        k[K_FENCE_MARGIN], k[K_BODY_RADIUS], k[K_LEG_END] = fence.margin_m, fence.radius_m, driver.leg.end_m
        self.ahead = driver._ahead
        switch_m, actuation = np.array(plan.switch_m), np.array(plan.actuation, dtype=np.float64)
        moving = (driver._progress, driver._limits, driver.now, driver._body)
        self.way = (driver._rows, plan.speeds, switch_m, actuation, *moving, fence.outline, fence.body)
        return True

    def end(self, tick: int, *, sensed: int) -> Command:
        """Give back after `tick`, the last whole one; the estimator has seen all up to `sensed`."""
        s, job = self.state.tolist(), self._traversal.job
        estimator, hazards, intake = self._estimator, self._hazards, self._intake
        assert job is not None, "it was there at the beginning"
        intake.imu_tick = intake.encoder_tick = sensed
        intake._mag_tick = max(intake._mag_tick, sensed - sensed % MAG_EVERY_TICKS)
        intake.still_ticks, intake.accel_mps2 = int(s[STILL]), s[ACCEL]
        intake.encoder_rates = (s[RATE], s[RATE + 1])
        intake._left_rad, intake._right_rad = s[ANGLE], s[ANGLE + 1]
        intake._reading = ImuSample(*s[READING : READING + 6])
        intake._rates_then = (s[RATE_THEN], s[RATE_THEN + 1])
        stamp, east, north, variance, fix, satellites, age = s[FIX : FIX + FIX_COLUMNS]
        estimator.last_fix = GnssSample(stamp, east, north, variance, int(fix), int(satellites), age)
        estimator.last_used_stamp_s = s[LAST_USED]
        estimator._slot, estimator._tick = sensed % m.RING, sensed
        hazards._expected = [s[EXPECTED], s[EXPECTED + 1]]
        first, count = int(s[FLOW_FIRST]), int(s[FLOW_COUNT])
        hazards._flow = deque(np.roll(self.flows, -first)[:count].tolist(), h.FLOW_WINDOW_TICKS)
        hazards._tank_l, hazards._flow_sum_l = s[TANK], s[FLOW_SUM]
        hazards._valve, hazards._valve_ticks = s[FLOW_VALVE] > 0.0, int(s[FLOW_TICKS])
        self._watch._tick = tick
        command = Command(s[COMMAND], s[COMMAND + 1], s[COMMAND + 2] > 0.0, s[COMMAND + 3] > 0.0, s[VALVE_AFTER])
        job._last = self._onboard._command = command
        job.sprayer.valve, job.sprayer._last_m = command.valve, s[SPRAYED_TO]
        job.sprayer.falls_from_m, job.sprayer.falls_to_m = s[FALLS_FROM], s[FALLS_TO]
        self._traversal._elapsed_s, self._traversal._time_s = s[ELAPSED], tick / 100
        self._onboard._estimate = None
        return command
