"""The robot's computer in nominal ticks, compiled: driving along a leg with nothing to decide.

Nearly all ticks of a session are alike: samples arrive in time, the pose is good, no hazard is in sight, the robot
follows its leg and the valve does what the plan says. `take_in` and `steer` do such a tick on plain arrays, with the
arithmetic of the sample buffer, `Estimator`, `LocalizationMonitor`, `Failsafe`, `Mission`, `PathTracker` and `Sprayer`
in the same order, so the bits are the same. If a tick needs a decision, the kernel returns before modifying state and
the full executive runs it. `Cruise` in `carry` passes the state across.
"""

from __future__ import annotations

import math

from touchline.schemas.messages import Actuation
from touchline.services.core.arrays import copy
from touchline.services.core.jit import kernel
from touchline.services.onboard import carried as c
from touchline.services.onboard.carried import Floats, Ring, Way
from touchline.services.onboard.control.path_tracker import END_TOLERANCE_M, observe
from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.estimation.delayed_fusion import advance, take_fix
from touchline.services.onboard.estimation.filter import FIX_FIXED, LEAD_S
from touchline.services.onboard.estimation.sample_buffer import FROZEN_RADPS, MAG_EVERY_TICKS, STILL_RAD, STILL_TICKS
from touchline.services.onboard.estimation.standing import JOLT_MPS2
from touchline.services.onboard.estimation.tail import CONTRADICTED
from touchline.services.onboard.executive import failsafe as h
from touchline.services.onboard.executive import localization_monitor as monitor
from touchline.services.onboard.executive.geofence import beyond_m
from touchline.services.onboard.interface import TICK_S
from touchline.services.onboard.trajectory import path_projection as t
from touchline.services.onboard.trajectory.path import FORWARD
from touchline.services.onboard.trajectory.path_projection import track

_VALVE, _DISC = Actuation.VALVE, Actuation.DISC


@kernel
def _frozen(samples: Floats, s: Floats) -> bool:
    """Whether the IMU repeats itself while the wheels change their rates."""
    for axis in range(6):
        if samples[axis] != s[c.READING + axis]:
            return False
    change = max(abs(s[c.RATE] - s[c.RATE_THEN]), abs(s[c.RATE + 1] - s[c.RATE_THEN + 1]))
    frozen: bool = change > FROZEN_RADPS
    return frozen


@kernel
def _remember(samples: Floats, s: Floats) -> None:
    new = False
    for axis in range(6):
        if samples[axis] != s[c.READING + axis]:
            new = True
            s[c.READING + axis] = samples[axis]
    if new:
        s[c.RATE_THEN], s[c.RATE_THEN + 1] = s[c.RATE], s[c.RATE + 1]


@kernel
def _take_samples(tick: int, samples: Floats, inputs: Floats, s: Floats, k: Floats) -> None:
    """As `Intake.take`, for samples of this tick that follow on those of the last one."""
    row = inputs[tick % m.RING]
    for column in range(m.INPUTS):
        row[column] = math.nan
    _remember(samples, s)
    row[m.IN_GYRO] = samples[2]
    row[m.IN_ACCEL] = 0.5 * (samples[3] + s[c.ACCEL])
    row[m.IN_SIDE] = samples[4]
    s[c.ACCEL] = samples[3]
    still = True
    for wheel in range(2):
        turned = samples[9 + wheel] - s[c.ANGLE + wheel]
        s[c.ANGLE + wheel] = samples[9 + wheel]
        s[c.RATE + wheel] = turned / TICK_S
        still = still and abs(turned) < STILL_RAD
    s[c.STILL] = s[c.STILL] + 1.0 if still else 0.0
    row[m.IN_LEFT] = s[c.RATE] * k[c.K_RADIUS]
    row[m.IN_RIGHT] = s[c.RATE + 1] * k[c.K_RADIUS]
    row[m.IN_SPAN] = 1.0
    row[m.IN_STILL] = 1.0 if s[c.STILL] >= STILL_TICKS else 0.0
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
    xs, covariances, inputs, entered, figures, n, slow = ring
    _take_samples(tick, samples, inputs, s, k)
    if fixes > 0 and fix[c.F_STAMP] > s[c.FIX + c.F_STAMP] and fix[c.F_STAMP] <= tick / 100 + LEAD_S:
        for column in range(c.FIX_COLUMNS):
            s[c.FIX + column] = fix[column]
    advance(xs, covariances, inputs, entered, figures, n, slow, tick, tick, tick)
    if fixes == 0:
        return True
    valid = math.floor(fix[c.F_STAMP] / TICK_S + 1e-6)
    row = entered[m.RING]
    row[m.FIX_EAST], row[m.FIX_NORTH] = fix[c.F_EAST], fix[c.F_NORTH]
    row[m.FIX_AFTER] = fix[c.F_STAMP] - valid * TICK_S
    row[m.FIX_VARIANCE] = figures[m.C_R_GNSS] + max(fix[c.F_VARIANCE] - figures[m.C_R_GNSS] - figures[m.C_GM_VAR], 0.0)
    used = n[m.N_FIXES]
    take_fix(xs, covariances, inputs, entered, figures, n, tick, int(s[c.FIRST_TICK]), valid)
    if n[m.N_FIXES] > used:
        s[c.LAST_USED] = max(s[c.LAST_USED], fix[c.F_STAMP])
    return True


@kernel
def _trusted(tick: int, P: Floats, n: Floats, s: Floats, k: Floats) -> bool:
    """Whether `Watch` finds nothing wrong with the pose."""
    now_s = tick / 100
    fix = s[c.FIX : c.FIX + c.FIX_COLUMNS]
    fresh = fix[c.F_AGE] <= monitor.MAX_CORRECTION_AGE_S and now_s - fix[c.F_STAMP] <= k[c.K_FIX_AGE]
    used = n[m.FIX_DOUBT] < CONTRADICTED and now_s - s[c.LAST_USED] <= k[c.K_FIX_AGE]
    consistent = n[m.NIS_FIX_RECENT] <= monitor.MAX_NIS and n[m.ENCODER_REJECTED_RECENT] <= monitor.MAX_SLIP
    sigma = math.sqrt(max(P[m.EAST, m.EAST], P[m.NORTH, m.NORTH]))
    known = sigma <= monitor.MAX_POSITION_SIGMA_M and sigma <= monitor.MAX_BLIND_SIGMA_M
    return fix[c.F_FIX] == FIX_FIXED and fresh and used and consistent and known


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
    doubt_m = h.HEADING_DOUBT * sigma_rad * k[c.K_BODY_RADIUS]
    if beyond_m(fence, shape, k[c.K_BODY_RADIUS], x[m.EAST], x[m.NORTH], x[m.HEADING]) > k[c.K_FENCE_MARGIN] + doubt_m:
        return False
    lag, most = k[c.K_LAG], k[c.K_MAX_STEP]
    left = s[c.EXPECTED] + min(max(lag * (s[c.COMMAND] - s[c.EXPECTED]), -most), most)
    right = s[c.EXPECTED + 1] + min(max(lag * (s[c.COMMAND + 1] - s[c.EXPECTED + 1]), -most), most)
    if abs(s[c.RATE] - left) > max(h.WHEEL_TOLERANCE_RADPS, h.WHEEL_TOLERANCE * abs(left)):
        return False
    if abs(s[c.RATE + 1] - right) > max(h.WHEEL_TOLERANCE_RADPS, h.WHEEL_TOLERANCE * abs(right)):
        return False

    used_l, valve = s[c.TANK] - tank_l, s[c.COMMAND + 2]
    total, ticks, count, first = s[c.FLOW_SUM], s[c.FLOW_TICKS], int(s[c.FLOW_COUNT]), int(s[c.FLOW_FIRST])
    if valve != s[c.FLOW_VALVE] or not abs(used_l) < h.REFILL_L:
        total, ticks, count, first = 0.0, 0.0, 0, 0
    ticks += 1.0
    if ticks > k[c.K_SETTLE_TICKS]:
        if count == h.FLOW_WINDOW_TICKS:
            total -= flows[first]
        total += used_l
        filled = min(count + 1, h.FLOW_WINDOW_TICKS)
        if filled == h.FLOW_WINDOW_TICKS:
            share = total / (h.FLOW_WINDOW_TICKS * k[c.K_NOMINAL_L])
            if (valve > 0.0 and share < h.DRY_SHARE) or (valve == 0.0 and share > h.LEAK_SHARE):
                return False
        flows[(first + count) % h.FLOW_WINDOW_TICKS] = used_l
        if count == h.FLOW_WINDOW_TICKS:
            first = (first + 1) % h.FLOW_WINDOW_TICKS
        count = filled
    elif count == h.FLOW_WINDOW_TICKS:
        return False
    s[c.EXPECTED], s[c.EXPECTED + 1] = left, right
    s[c.TANK], s[c.FLOW_VALVE] = tank_l, valve
    s[c.FLOW_SUM], s[c.FLOW_TICKS], s[c.FLOW_COUNT], s[c.FLOW_FIRST] = total, ticks, float(count), float(first)
    return True


@kernel
def _wanted(arc_m: float, ahead_m: float, switch_m: Floats, actuation: Floats, s: Floats) -> int:
    """As `Sprayer.wanted_at`, what the plan asks for at either place; and as `Sprayer.step` while nothing is owed."""
    at = int(s[c.SWITCH])
    while at >= 0 and switch_m[at] > arc_m:  # the nozzle goes back a little when a standing robot turns
        at -= 1
    while at + 1 < len(switch_m) and switch_m[at + 1] <= arc_m:
        at += 1
    s[c.SWITCH] = at
    now = int(actuation[at]) if at >= 0 else 0
    next_m = switch_m[at + 1] if at + 1 < len(switch_m) else math.inf
    while at + 1 < len(switch_m) and switch_m[at + 1] <= ahead_m:
        at += 1
    then = int(actuation[at]) if at >= 0 else 0
    sprays, is_open = now & _VALVE != 0, s[c.COMMAND + 2] > 0.0
    s[c.OPEN], s[c.SWITCH_AT] = 1.0 if (now | then) & _VALVE else 0.0, arc_m
    if sprays == is_open and (then & _VALVE != 0) != sprays:
        s[c.OPEN], s[c.SWITCH_AT] = 0.0 if is_open else 1.0, next_m
    return now | then


@kernel
def speed_now_mps(x: Floats, z: Floats, s: Floats) -> float:
    """As `Estimator.speed_now_mps`; `z` (INPUTS,) of the tick."""
    speed_mps: float = x[m.SPEED]
    accel_mps2 = s[c.ACCEL] - x[m.ACCEL_BIAS]
    if z[m.IN_STILL] > 0.0 and abs(accel_mps2) > JOLT_MPS2:
        return speed_mps
    speed_mps += 0.5 * TICK_S * accel_mps2
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
    if not _trusted(tick, P, ring[5], s, k):
        return -1
    copy(progress, saved)
    copy(now, saved[t.PROGRESS :])
    limits[t.L_BACK_TO] = 0.0
    observe(x, speed_now_mps(x, ring[2][tick % m.RING], s), s[c.COMMAND], s[c.COMMAND + 1], body, now)
    track(rows, FORWARD, speeds, progress, limits, t.MODE_PROFILE, x[m.EAST], x[m.NORTH], x[m.HEADING], now, ahead)
    arc, speed = progress[t.P_ARC], now[t.SPEED]
    s[c.NOZZLE_AT] = arc - limits[t.L_NOZZLE_Y] * now[t.HEADING_ERROR]
    wanted: int = _wanted(s[c.NOZZLE_AT], s[c.NOZZLE_AT] + TICK_S * max(speed, 0.0), switch_m, actuation, s)
    astray = abs(now[t.NOZZLE_LATERAL]) > monitor.MAX_LATERAL_M
    sigma_rad = math.sqrt(P[m.HEADING, m.HEADING])
    doubtful = sigma_rad > monitor.MAX_HEADING_SIGMA_RAD
    arrived = arc >= k[c.K_LEG_END] - END_TOLERANCE_M and abs(speed) < 2.0 * t.CREEP_MPS
    well = not arrived and not ((astray or doubtful) and wanted & _VALVE)
    if not well or not _unharmed(x, sigma_rad, battery, tank_l, fence, shape, flows, s, k):
        copy(saved[: t.PROGRESS], progress)
        copy(saved[t.PROGRESS :], now)
        return -1
    return wanted


@kernel
def obey(wheels: Floats, wanted: int, speed_mps: float, s: Floats, k: Floats) -> None:
    """End a quiet tick with the follower's wheel speeds (2,) [rad/s] and the plan's actuation."""
    s[c.COMMAND], s[c.COMMAND + 1] = wheels[0], wheels[1]
    s[c.VALVE_AFTER] = 0.0
    if s[c.OPEN] != s[c.COMMAND + 2]:
        speed_mps, place_m = max(speed_mps, 0.0), s[c.SWITCH_AT]
        if place_m > s[c.NOZZLE_AT]:
            s[c.VALVE_AFTER] = min((place_m - s[c.NOZZLE_AT]) / speed_mps, TICK_S)
        if s[c.OPEN] > 0.0:
            s[c.FALLS_FROM], s[c.FALLS_TO] = place_m + speed_mps * k[c.K_VALVE_ON], math.inf
        else:
            s[c.FALLS_TO] = place_m + speed_mps * k[c.K_VALVE_OFF]
    s[c.COMMAND + 2] = s[c.OPEN]
    s[c.COMMAND + 3] = 1.0 if wanted & _DISC else 0.0
    s[c.SPRAYED_TO] = s[c.NOZZLE_AT]
    s[c.ELAPSED] += TICK_S
