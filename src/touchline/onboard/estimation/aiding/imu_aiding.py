"""IMU in the filter: the gyro measures the yaw rate, the accelerometer drives the prediction of the speed."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.estimation.learned_constants import start_variance
from touchline.onboard.estimation.standing import settle_dispute
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply
from touchline.onboard.filter_model import (
    ACCEL_BIAS,
    GATE_1_DOF,
    GYRO_BIAS,
    GYRO_SCALE,
    HEADING,
    RING,
    SPEED,
    STATES,
    VARYING,
    YAW_RATE,
    FilterCounters,
    FilterFigures,
    TickInputs,
)
from touchline.onboard.interface import ACCEL, GYRO, TICK_S
from touchline.schemas.onboard import OnboardConfig

FROZEN_RADPS: Final = 0.05
"""Change of a wheel's rate over which an IMU that repeats its reading is frozen: that is no new sample."""
STILL_YAW_VAR: Final = 4e-8
"""Variance of the yaw rate of a robot whose wheels stand: (0.2 mrad/s)²."""
_NO_IMU_SPEED_VAR = 1e-4  # (1 m/s² · a tick)²
_ROUGH_SHARE = 1.0 / 30.0  # weight of the newest tick
_ROUGH_MOST = 1.0  # (m/s²)² a tick counts: one jolt is no shaking
_ROUGH_FROM = 0.3**2  # (m/s²)²; noise by the data sheet makes 0.012², driving a plan at most 0.17², an e-stop 0.31²
_PITCH_SHARES = (0.1, 0.01)  # weights of the newest tick: motors vibrate faster, biases and slopes change more slowly
_PITCHING_FROM = 0.01**2  # (rad/s)²; noise by the data sheet makes 0.0006², a cheap gyro's cross axis in curves 0.01²
_PITCHES_FOR_S = 0.1  # a rate that oscillates at 1 to 2 Hz stays alike for as long
_WAVES_CHANGE_IN_S = 1.0  # a wave of 1 to 2 m at 1 m/s
_SPEED_NOISE_MPS = 0.0005  # per tick, from pitching and vibration, beyond the accelerometer's own noise
_GYRO_FLOOR_RADPS = 1e-4
_SIDE_FLOOR_MPS2 = 0.02
_SCALE_WALK_RTS = 1e-5  # 0.02 % in ten minutes [assumed]: cheap gyros change by 0.03 % per K
_WARMING_S = 60.0  # over which a bias that drifts with the temperature counts as a random walk

Floats = NDArray[np.float64]


def imu_figures(c: FilterFigures, config: OnboardConfig) -> None:
    """Fill in the noise figures of the IMU.

    Args:
        c: Figures of the filter, updated.
        config: Configuration, which has the data sheet.
    """
    imu = config.imu
    c.q_speed = imu.accel_density_mps2_rthz**2 * TICK_S + _SPEED_NOISE_MPS**2
    warming_kps = imu.warming_k / imu.warming_tau_s
    gyro_drift, accel_drift = (
        per_k * warming_kps * math.sqrt(_WARMING_S)
        for per_k in (imu.gyro_temperature_radps_per_k, imu.accel_temperature_mps2_per_k)
    )
    c.q_gyro_bias = (max(imu.gyro_bias_walk_radps_rts, 1e-6) ** 2 + gyro_drift**2) * TICK_S
    c.q_accel_bias = (max(imu.accel_bias_walk_mps2_rts, 1e-4) ** 2 + accel_drift**2) * TICK_S
    c.side_bias_var = imu.accel_turn_on_bias_mps2**2 + 1e-6
    c.q_side_bias = c.q_accel_bias
    c.r_side = imu.accel_density_mps2_rthz**2 / TICK_S + _SIDE_FLOOR_MPS2**2
    c.gyro_scale = 1.0 + imu.gyro_scale_relative
    c.constant_var[0] = start_variance(0, imu.gyro_scale_sigma, config.calibrated.gyro_scale)
    c.q_constant[0] = _SCALE_WALK_RTS**2 * TICK_S
    c.r_gyro = imu.gyro_density_radps_rthz**2 / TICK_S + _GYRO_FLOOR_RADPS**2


@kernel
def _frozen(c: ComputerState) -> bool:
    """Return whether the IMU repeats itself while the wheels change their rates; a new reading is remembered."""
    state = c.buffer
    new = state.imu_tick < 0
    for axis in range(6):
        new = new or c.frame.readings[axis] != state.reading[axis]
        state.reading[axis] = c.frame.readings[axis]
    if new or not state.repeated:
        # The encoders are read behind the IMU: what the wheels did at a reading is known when the next one comes.
        for actuator in range(len(state.measured)):
            state.measured_then[actuator] = state.measured[actuator]
        state.repeated = not new
        return False
    change = 0.0
    for actuator in range(len(state.measured)):
        change = max(change, abs(state.measured[actuator] - state.measured_then[actuator]))
    return change > FROZEN_RADPS


@kernel
def take_imu(c: ComputerState) -> bool:
    """Enter a sample in the inputs of its tick, unless it is an old or a frozen one.

    The acceleration is the mean of this sample and the one before.

    Args:
        c: State with the frame; buffer and inputs are updated.

    Returns:
        Whether the sample is entered.
    """
    state, sampled = c.buffer, c.frame.imu_tick
    if sampled <= state.imu_tick or _frozen(c):
        return False
    accel = c.frame.readings[ACCEL]
    before = state.accel_mps2 if sampled == state.imu_tick + 1 else accel
    row = c.filter.inputs[sampled % RING]
    row.gyro_radps = c.frame.readings[GYRO + 2] / c.filter.figures.gyro_scale
    row.accel_mps2 = 0.5 * (accel + before)
    row.pitch_radps = c.frame.readings[GYRO + 1]
    row.side_mps2 = c.frame.readings[ACCEL + 1]
    state.accel_mps2 = accel
    state.imu_tick = sampled
    return True


@borrowing
def forward_acceleration(x: Floats, P: Floats, before: TickInputs, z: TickInputs, c: FilterFigures) -> float:
    """Return the acceleration with which a tick is predicted [m/s²], as the accelerometer reads it.

    It is the bias, as at constant speed, if there is no sample, or if wheels that stand contradict it.

    Args:
        x: (STATES,) state of the tick before.
        P: (STATES, STATES) its covariance, updated.
        before: Inputs of the tick before.
        z: Inputs of this tick, updated.
        c: Figures of the filter.
    """
    disputed = settle_dispute(x, P, before, z, c)
    accel: float = z.accel_mps2
    if math.isnan(accel):
        accel = x[ACCEL_BIAS]
        P[SPEED, SPEED] += _NO_IMU_SPEED_VAR
    elif disputed:
        accel = x[ACCEL_BIAS]
    return accel


@borrowing
def add_shaking_noise(P: Floats, before: TickInputs, z: TickInputs) -> None:
    """Add process noise to the speed while the accelerometer shakes.

    A mount that has come loose shakes by far more than the data sheet says. Without this noise it carries the speed
    away from the wheels, and these are rejected for it; the position then is off by many times its σ and contradicts
    the fixes for good. Noise of σ a sample steps by σ/√2 in the mean of two and adds σ·10 ms to the speed. One jolt, as
    of a wheel that begins to slip, is no shaking: there the accelerometer is right.

    Args:
        P: (STATES, STATES) predicted covariance, updated.
        before: Inputs of the tick before.
        z: Inputs of this tick; `rough` is filled in.
    """
    z.rough = before.rough
    step = z.accel_mps2 - before.accel_mps2
    if not math.isnan(step):
        z.rough += _ROUGH_SHARE * (min(step * step, _ROUGH_MOST) - z.rough)
    if z.rough > _ROUGH_FROM:
        P[SPEED, SPEED] += 2.0 * z.rough * TICK_S * TICK_S


@borrowing
def add_pitching_noise(P: Floats, before: TickInputs, z: TickInputs) -> None:
    """Add process noise to the forward accelerometer's bias while the body pitches on waves of the ground.

    That bias holds gravity's part. On waves of 2 cm it changes by 0.3 m/s² within half a second; a filter that takes it
    for constant explains this by wheels that slip. A rate of σ that stays alike for τ adds a random walk of g²·σ²·τ.
    Along the crests the body pitches too slowly to be felt, but leans: gravity's part across varies, by its variance
    within a second, and the part forward is taken to do so, too.

    Args:
        P: (STATES, STATES) predicted covariance, updated.
        before: Inputs of the tick before.
        z: Inputs of this tick, with `waves_var`; means of the pitch rate and `pitching` are filled in.
    """
    fast, slow, z.pitching = before.pitch_means_radps[0], before.pitch_means_radps[1], before.pitching
    if not math.isnan(z.pitch_radps):
        if math.isnan(slow):
            fast = slow = z.pitch_radps
        fast += _PITCH_SHARES[0] * (z.pitch_radps - fast)
        slow += _PITCH_SHARES[1] * (z.pitch_radps - slow)
        z.pitching += _PITCH_SHARES[1] * ((fast - slow) ** 2 - z.pitching)
    z.pitch_means_radps[0], z.pitch_means_radps[1] = fast, slow
    P[ACCEL_BIAS, ACCEL_BIAS] += z.waves_var / _WAVES_CHANGE_IN_S * TICK_S
    if z.pitching > _PITCHING_FROM:
        P[ACCEL_BIAS, ACCEL_BIAS] += GRAVITY_MPS2**2 * (z.pitching - _PITCHING_FROM) * _PITCHES_FOR_S * TICK_S


@borrowing
def _gyro_disputed(at: TickEstimate, c: FilterFigures, n: FilterCounters, live: bool) -> bool:
    """Return whether the gyro says that the standing robot turns: it is broken, or somebody turns the robot.

    Neither can be ruled out, so the reading is not used, and the heading becomes as uncertain as that turn is large.
    """
    x, P, z = at
    if not z.still:
        return False
    turn = z.gyro_radps - x[GYRO_BIAS]
    if turn * turn <= GATE_1_DOF * (P[GYRO_BIAS, GYRO_BIAS] + c.r_gyro + STILL_YAW_VAR):
        return False
    if live:
        n.gyro_rejected += 1
    sigma = math.sqrt(P[HEADING, HEADING]) + abs(turn) * TICK_S
    P[HEADING, HEADING] = sigma * sigma
    return True


@borrowing
def use_gyro(at: TickEstimate, c: FilterFigures, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update with the gyro: yaw rate, which it reads a little too large or small, plus bias.

    Args:
        at: Tick, whose state and covariance are updated.
        c: Figures of the filter.
        n: Counters, updated if the tick is live.
        live: Whether the measurement is new.
        scratch: Overwritten.
    """
    x, P, z = at
    h, g, _ = scratch
    row = h[0]
    for k in range(STATES):
        row[k] = 0.0
    if not math.isnan(z.gyro_radps) and not _gyro_disputed(at, c, n, live):
        row[YAW_RATE], row[GYRO_BIAS], row[GYRO_SCALE] = 1.0 + x[GYRO_SCALE], 1.0, x[YAW_RATE]
        apply(x, P, row, z.gyro_radps - row[YAW_RATE] * x[YAW_RATE] - x[GYRO_BIAS], c.r_gyro, g, VARYING)
