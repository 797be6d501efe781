"""The 100 Hz sensors (IMU, magnetometer, wheel encoders) in one kernel call per onboard tick.

IMU: the mean rate and specific force over the tick, white noise from the density, a turn-on bias drawn once per seed
and a bias random walk. Magnetometer: the earth's field (declination 0, stated dip) turned into the body, a hard-iron
offset that turns with the body, a slowly varying disturbance of the surroundings and white noise. Encoders: the
cumulative wheel angle floored to whole ticks, so that no fraction is ever lost.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.robot_sim.world import body
from services.robot_sim.world.randomness import (
    STREAM_ENCODER,
    STREAM_IMU,
    STREAM_MAGNETOMETER,
    normal,
    uniform,
)

GRAVITY_MPS2: Final = 9.80665

# Readings.
IMU: Final = 0  # gyro x y z, accel x y z
MAG: Final = 6  # x y z
ENCODER: Final = 9  # left, right
READINGS: Final = 11

# Sensor state.
GYRO_BIAS: Final = 0  # x y z
ACCEL_BIAS: Final = 3
HARD_IRON: Final = 6
DISTURBANCE: Final = 9  # east, north, up, in the map frame
ENCODER_PHASE: Final = 12  # left, right, rad: where within a tick the wheel stood at switch-on
STATE_SIZE: Final = 14

# Parameters.
P_GYRO_WHITE: Final = 0  # rad/s per sample
P_GYRO_BIAS: Final = 1  # rad/s, 1σ at turn-on
P_GYRO_WALK: Final = 2  # rad/s per tick
P_ACCEL_WHITE: Final = 3  # m/s² per sample
P_ACCEL_BIAS: Final = 4
P_ACCEL_WALK: Final = 5
P_FIELD_HORIZONTAL: Final = 6  # T
P_FIELD_DOWN: Final = 7
P_MAG_WHITE: Final = 8  # T per sample
P_MAG_HARD_IRON: Final = 9  # T, 1σ per axis
P_MAG_DISTURBANCE: Final = 10  # T, 1σ per axis
P_MAG_DECAY: Final = 11  # per tick
P_ENCODER_TICK: Final = 12  # rad; 0: not quantised
PARAMETER_SIZE: Final = 13

_TURN_ON: Final = -1  # the "tick" that keys what is drawn once


@kernel
def switch_on(sensor: NDArray[np.float64], p: NDArray[np.float64], seed: int) -> None:
    """Draw what is fixed at turn-on into `sensor` (STATE_SIZE,): biases, hard iron, disturbance, encoder phase."""
    for axis in range(3):
        sensor[GYRO_BIAS + axis] = p[P_GYRO_BIAS] * normal(seed, STREAM_IMU, _TURN_ON, axis)
        sensor[ACCEL_BIAS + axis] = p[P_ACCEL_BIAS] * normal(seed, STREAM_IMU, _TURN_ON, 3 + axis)
        sensor[HARD_IRON + axis] = p[P_MAG_HARD_IRON] * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, axis)
        sensor[DISTURBANCE + axis] = p[P_MAG_DISTURBANCE] * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, 3 + axis)
    for wheel in range(2):
        sensor[ENCODER_PHASE + wheel] = p[P_ENCODER_TICK] * uniform(seed, STREAM_ENCODER, _TURN_ON, wheel)


@kernel
def measure(
    world: NDArray[np.float64],
    sensor: NDArray[np.float64],
    p: NDArray[np.float64],
    seed: int,
    tick: int,
    readings: NDArray[np.float64],
) -> None:
    """Read every 100 Hz sensor once.

    Args:
        world: (body.STATE_SIZE,) the true state after the tick's physics.
        sensor: (STATE_SIZE,) the sensors' own state, changed in place.
        p: (PARAMETER_SIZE,) noise figures.
        seed: Of the scenario.
        tick: Onboard tick.
        readings: (READINGS,) filled, SI units, body frame.
    """
    truth = (
        0.0,
        0.0,
        world[body.MEAN_YAW_RATE],
        world[body.MEAN_ACCEL_X],
        world[body.MEAN_ACCEL_Y],
        GRAVITY_MPS2,
    )
    for axis in range(6):
        gyro = axis < 3
        walk = p[P_GYRO_WALK] if gyro else p[P_ACCEL_WALK]
        white = p[P_GYRO_WHITE] if gyro else p[P_ACCEL_WHITE]
        if walk > 0.0:
            sensor[GYRO_BIAS + axis] += walk * normal(seed, STREAM_IMU, tick, 6 + axis)
        noise = white * normal(seed, STREAM_IMU, tick, axis) if white > 0.0 else 0.0
        readings[IMU + axis] = truth[axis] + sensor[GYRO_BIAS + axis] + noise

    if p[P_MAG_DISTURBANCE] > 0.0:
        fresh = p[P_MAG_DISTURBANCE] * math.sqrt(1.0 - p[P_MAG_DECAY] * p[P_MAG_DECAY])
        for axis in range(3):
            draw = normal(seed, STREAM_MAGNETOMETER, tick, 3 + axis)
            sensor[DISTURBANCE + axis] = p[P_MAG_DECAY] * sensor[DISTURBANCE + axis] + fresh * draw
    east = sensor[DISTURBANCE]
    north = p[P_FIELD_HORIZONTAL] + sensor[DISTURBANCE + 1]
    up = sensor[DISTURBANCE + 2] - p[P_FIELD_DOWN]
    cos, sin = math.cos(world[body.HEADING]), math.sin(world[body.HEADING])
    field = (cos * east + sin * north, cos * north - sin * east, up)
    for axis in range(3):
        noise = p[P_MAG_WHITE] * normal(seed, STREAM_MAGNETOMETER, tick, axis) if p[P_MAG_WHITE] > 0.0 else 0.0
        readings[MAG + axis] = field[axis] + sensor[HARD_IRON + axis] + noise

    quantum = p[P_ENCODER_TICK]
    for wheel in range(2):
        angle = world[body.LEFT_ANGLE + wheel]
        if quantum > 0.0:
            angle = math.floor((angle + sensor[ENCODER_PHASE + wheel]) / quantum) * quantum
        readings[ENCODER + wheel] = angle
