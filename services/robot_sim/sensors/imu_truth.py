"""Emulated IMU: mean rates and specific force over the tick, with white noise, biases and their drift."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.core.random import STREAM_FAULT, STREAM_IMU, STREAM_VIBRATION, normal
from touchline.core.records import Record
from touchline.onboard.interface import GYRO, TICK_S
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.sensors.moment import TURN_ON_TICK, Moment

_AXES: Final = 6

# Channels of STREAM_IMU, one for each axis: gyro x, y, z, accelerometer x, y, z.
_WHITE: Final = 0
_WALK: Final = 6
# Those in the tick of turn-on:
_BIAS: Final = 0
_WARMTH: Final = 6
_SHAKEN: Final = 3  # channel of STREAM_FAULT
_PASS: Final = 7
"""Samples whose mean is taken from the middle one of them: white noise above 11 Hz (3 dB) remains."""

Floats = NDArray[np.float64]


class ImuFigures(Record):
    """Noise figures of one IMU in one scenario, standard deviations per axis where not said otherwise."""

    gyro_white_radps: float
    """White noise per sample."""
    gyro_bias_radps: float
    """Bias at turn-on."""
    gyro_walk_radps: float
    """Change of the bias per tick."""
    gyro_warmth_radps_per_k: float
    """Change of the bias with the temperature."""
    accel_white_mps2: float
    accel_bias_mps2: float
    accel_walk_mps2: float
    accel_warmth_mps2_per_k: float
    vibration: float
    """Vibration of the drive per speed."""
    warming_k: float
    """Final rise of the temperature (a fixed value)."""
    warming_tau_s: float
    """Time constant of that rise (a fixed value)."""
    gyro_gain: float
    """Reading of the gyro about z for a rate about it (a fixed value)."""
    gyro_lean: Annotated[Floats, 2]
    """Lean of its z axis, forward and to the left [rad] (fixed values)."""


class ImuState(Record):
    """State of the IMU; arrays hold gyro x, y, z [rad/s], then accelerometer x, y, z [m/s²]."""

    figures: ImuFigures
    bias: Annotated[Floats, _AXES]
    """Bias, random walk included."""
    warmth: Annotated[Floats, _AXES]
    """Change of the bias per kelvin."""


@kernel
def switch_on(imu: Sequence[ImuState], seed: int) -> None:
    """Draw what stays fixed from turn-on: the biases, and their change with the temperature.

    Args:
        imu: (1,) state with its figures; the rest is filled in.
        seed: Seed of the scenario.
    """
    s, f = imu[0], imu[0].figures
    for axis in range(3):
        s.bias[axis] = f.gyro_bias_radps * normal(seed, STREAM_IMU, TURN_ON_TICK, _BIAS + axis)
        s.bias[3 + axis] = f.accel_bias_mps2 * normal(seed, STREAM_IMU, TURN_ON_TICK, _BIAS + 3 + axis)
        s.warmth[axis] = f.gyro_warmth_radps_per_k * normal(seed, STREAM_IMU, TURN_ON_TICK, _WARMTH + axis)
        s.warmth[3 + axis] = f.accel_warmth_mps2_per_k * normal(seed, STREAM_IMU, TURN_ON_TICK, _WARMTH + 3 + axis)


@kernel
def _vibration(seed: int, tick: int, axis: int) -> float:
    """Return white noise with a standard deviation of 1, of which what is slower than 10 Hz is removed."""
    mean = 0.0
    for back in range(_PASS):
        mean += normal(seed, STREAM_VIBRATION, tick - back, axis) / _PASS
    found: float = (normal(seed, STREAM_VIBRATION, tick - _PASS // 2, axis) - mean) * math.sqrt(_PASS / (_PASS - 1.0))
    return found


@kernel
def measure(moment: Moment, imu: Sequence[ImuState], readings: Floats) -> None:
    """Measure the rates and the specific force of a tick.

    White noise and random walk are those of IEEE Std 952-1997, annex C: a density N [unit/√Hz] is N/√(10 ms) per
    sample, a walk K [unit/√s] is K·√(10 ms) per tick. A gyro that leans by small angles reads its rates turned by them;
    the accelerometer's axes are the body's.

    Args:
        moment: End of the tick.
        imu: (1,) state, updated.
        readings: (READINGS,) of `onboard/interface.py`, with the values of the tick before; gyro [rad/s] and
            accelerometer [m/s²], body frame, are filled in unless the sensor is stuck.
    """
    seed, tick, state, effects = moment.seed, moment.tick, moment.state[0], moment.effects[0]
    s, f = imu[0], imu[0].figures
    warmer = f.warming_k * (1.0 - math.exp(-TICK_S * tick / f.warming_tau_s))
    roll_rate, pitch_rate, yaw_rate = (
        state.mean_roll_rate_radps,
        state.mean_pitch_rate_radps,
        state.mean_yaw_rate_radps,
    )
    lean_x, lean_y = f.gyro_lean[0], f.gyro_lean[1]
    truth = (
        roll_rate - lean_x * yaw_rate,
        pitch_rate - lean_y * yaw_rate,
        f.gyro_gain * yaw_rate + lean_x * roll_rate + lean_y * pitch_rate + effects.gyro_bias_radps,
        state.mean_accel_x_mps2 + effects.accel_bias_mps2,
        state.mean_accel_y_mps2,
        GRAVITY_MPS2 * state.up_z + state.mean_accel_z_mps2,
    )
    for axis in range(_AXES):
        gyro = axis < 3
        walk = f.gyro_walk_radps if gyro else f.accel_walk_mps2
        if walk > 0.0:
            s.bias[axis] += walk * normal(seed, STREAM_IMU, tick, _WALK + axis)
        reading = truth[axis] + s.bias[axis] + warmer * s.warmth[axis]
        sigma = f.gyro_white_radps if gyro else f.accel_white_mps2
        if sigma > 0.0:
            reading += sigma * normal(seed, STREAM_IMU, tick, _WHITE + axis)
        if f.vibration > 0.0 and not gyro:
            reading += f.vibration * abs(state.speed_mps) * _vibration(seed, tick, axis)
        shaken = effects.gyro_white_radps if gyro else effects.accel_white_mps2
        if shaken > 0.0:
            reading += shaken * normal(seed, STREAM_FAULT, tick, _SHAKEN + axis)
        if not effects.imu_stuck:
            readings[GYRO + axis] = reading


def make_imu(scenario: Scenario) -> ImuState:
    """Make an IMU that has just been switched on.

    Args:
        scenario: Effective scenario, which has the noise, and the gyro's true scale and axes.
    """
    noise, truth, made = scenario.imu, scenario.truth, ImuState()
    lean = truth.gyro_lean_x_rad, truth.gyro_lean_y_rad
    per_sample, per_tick = 1.0 / math.sqrt(TICK_S), math.sqrt(TICK_S)
    made.figures.reset(
        gyro_white_radps=noise.gyro_density_radps_rthz * per_sample,
        gyro_bias_radps=noise.gyro_turn_on_bias_radps,
        gyro_walk_radps=noise.gyro_bias_walk_radps_rts * per_tick,
        gyro_warmth_radps_per_k=noise.gyro_temperature_radps_per_k,
        accel_white_mps2=noise.accel_density_mps2_rthz * per_sample,
        accel_bias_mps2=noise.accel_turn_on_bias_mps2,
        accel_walk_mps2=noise.accel_bias_walk_mps2_rts * per_tick,
        accel_warmth_mps2_per_k=noise.accel_temperature_mps2_per_k,
        vibration=truth.vibration_mps2,
        warming_k=noise.warming_k,
        warming_tau_s=noise.warming_tau_s,
        gyro_gain=1.0 + truth.gyro_scale_relative - 0.5 * (lean[0] ** 2 + lean[1] ** 2),
        gyro_lean=lean,
    )
    switch_on(made.array, scenario.seed)
    return made
