"""The 100 Hz sensors: IMU, magnetometer, encoders.

IMU: the mean rate and specific force over the tick, white noise from the density, a turn-on bias drawn once per seed, a
bias random walk and a bias that grows as the sensor warms up. Magnetometer: the earth's field (declination 0, stated
dip) and that of steel near by, turned into the body, through soft iron, plus hard iron, a slowly varying disturbance of
the surroundings and white noise. Encoders: the cumulative angle of each actuator floored to whole counts, so that no
fraction is ever lost.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.core.physical_constants import GRAVITY_MPS2
from touchline.services.core.random import (
    STREAM_ENCODER,
    STREAM_FAULT,
    STREAM_IMU,
    STREAM_MAGNETOMETER,
    normal,
    uniform,
)
from touchline.services.onboard.interface import ACTUATORS, ANGLES, GYRO, MAG, TICK_S
from touchline.services.robot_sim.sensors.zones import CENTRE_X, CENTRE_Y, VALUE_1, VALUE_2, distance
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world import effects as e

# Sensor state.
GYRO_BIAS: Final = 0  # x y z
ACCEL_BIAS: Final = 3
HARD_IRON: Final = 6
DISTURBANCE: Final = 9  # east, north, up, in the map frame
WARMTH: Final = 12  # gyro x y z, accel x y z: bias per kelvin
SOFT_IRON: Final = 18  # xx, xy, yy: gains less 1, cross-gain
ENCODER_PHASE: Final = 21  # of each actuator, rad: where between two counts it stood at switch-on
MISSED: Final = ENCODER_PHASE + ACTUATORS  # of each, rad: what an encoder that dropped out did not count
LAST_ANGLE: Final = MISSED + ACTUATORS  # of each, rad
STATE_SIZE: Final = LAST_ANGLE + ACTUATORS

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
P_GYRO_WARMTH: Final = 12  # rad/s per K, 1σ
P_ACCEL_WARMTH: Final = 13
P_WARMING: Final = 14  # K
P_WARMING_TAU: Final = 15  # s
P_SOFT_IRON: Final = 16  # 1σ
P_ENCODER_QUANTUM: Final = 17  # of each actuator, rad; 0: not quantised
PARAMETER_SIZE: Final = P_ENCODER_QUANTUM + ACTUATORS

_TURN_ON = -1  # the "tick" that keys what is drawn once

Floats = NDArray[np.float64]


@kernel
def switch_on(sensor: Floats, p: Floats, seed: int) -> None:
    """Draw what is fixed at turn-on into `sensor` (STATE_SIZE,): biases, iron, disturbance, encoder phase."""
    for axis in range(3):
        sensor[GYRO_BIAS + axis] = p[P_GYRO_BIAS] * normal(seed, STREAM_IMU, _TURN_ON, axis)
        sensor[ACCEL_BIAS + axis] = p[P_ACCEL_BIAS] * normal(seed, STREAM_IMU, _TURN_ON, 3 + axis)
        sensor[WARMTH + axis] = p[P_GYRO_WARMTH] * normal(seed, STREAM_IMU, _TURN_ON, 6 + axis)
        sensor[WARMTH + 3 + axis] = p[P_ACCEL_WARMTH] * normal(seed, STREAM_IMU, _TURN_ON, 9 + axis)
        sensor[HARD_IRON + axis] = p[P_MAG_HARD_IRON] * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, axis)
        sensor[DISTURBANCE + axis] = p[P_MAG_DISTURBANCE] * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, 3 + axis)
        sensor[SOFT_IRON + axis] = p[P_SOFT_IRON] * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, 6 + axis)
    for actuator in range(ACTUATORS):
        phase = uniform(seed, STREAM_ENCODER, _TURN_ON, actuator)
        sensor[ENCODER_PHASE + actuator] = p[P_ENCODER_QUANTUM + actuator] * phase


@kernel
def _inertial(
    world: Floats, sensor: Floats, p: Floats, effects: Floats, seed: int, tick: int, readings: Floats
) -> None:
    warmer = p[P_WARMING] * (1.0 - math.exp(-TICK_S * tick / p[P_WARMING_TAU]))
    truth = (
        0.0,
        0.0,
        world[body.MEAN_YAW_RATE] + effects[e.GYRO_BIAS],
        world[body.MEAN_ACCEL_X] + effects[e.ACCEL_BIAS],
        world[body.MEAN_ACCEL_Y],
        GRAVITY_MPS2 * world[body.UP_Z],
    )
    for axis in range(6):
        gyro = axis < 3
        walk = p[P_GYRO_WALK] if gyro else p[P_ACCEL_WALK]
        if walk > 0.0:
            sensor[GYRO_BIAS + axis] += walk * normal(seed, STREAM_IMU, tick, 6 + axis)
        reading = truth[axis] + sensor[GYRO_BIAS + axis] + warmer * sensor[WARMTH + axis]
        sigma = p[P_GYRO_WHITE] if gyro else p[P_ACCEL_WHITE]
        if sigma > 0.0:
            reading += sigma * normal(seed, STREAM_IMU, tick, axis)
        shaken = effects[e.GYRO_WHITE] if gyro else effects[e.ACCEL_WHITE]
        if shaken > 0.0:
            reading += shaken * normal(seed, STREAM_FAULT, tick, 3 + axis)
        if effects[e.IMU_STUCK] == 0.0:
            readings[GYRO + axis] = reading


@kernel
def _steel(world: Floats, steel: Floats, vertices: Floats) -> tuple[float, float]:
    """The field of steel near by, map frame (east, north) [T]."""
    east, north = 0.0, 0.0
    for index in range(len(steel)):
        place = steel[index]
        away = distance(place, vertices, world[body.EAST], world[body.NORTH])
        strength = place[VALUE_1] / (1.0 + away / place[VALUE_2]) ** 3
        dx, dy = place[CENTRE_X] - world[body.EAST], place[CENTRE_Y] - world[body.NORTH]
        length = math.hypot(dx, dy)
        if length > 1e-6:
            east += strength * dx / length
            north += strength * dy / length
    return east, north


@kernel
def _magnetic(
    world: Floats,
    sensor: Floats,
    p: Floats,
    steel: Floats,
    vertices: Floats,
    effects: Floats,
    seed: int,
    tick: int,
    readings: Floats,
) -> None:
    if p[P_MAG_DISTURBANCE] > 0.0:
        fresh = p[P_MAG_DISTURBANCE] * math.sqrt(1.0 - p[P_MAG_DECAY] * p[P_MAG_DECAY])
        for axis in range(3):
            draw = normal(seed, STREAM_MAGNETOMETER, tick, 3 + axis)
            sensor[DISTURBANCE + axis] = p[P_MAG_DECAY] * sensor[DISTURBANCE + axis] + fresh * draw
    steel_east, steel_north = _steel(world, steel, vertices)
    east = sensor[DISTURBANCE] + steel_east + effects[e.FIELD_EAST_T]
    north = p[P_FIELD_HORIZONTAL] + sensor[DISTURBANCE + 1] + steel_north + effects[e.FIELD_NORTH_T]
    up = sensor[DISTURBANCE + 2] - p[P_FIELD_DOWN]
    cos, sin = math.cos(world[body.HEADING]), math.sin(world[body.HEADING])
    ahead, left = cos * east + sin * north, cos * north - sin * east
    if world[body.UP_Z] < 1.0:  # on a slope the body's axes lean
        up_x, up_y, up_z = world[body.UP_X], world[body.UP_Y], world[body.UP_Z]
        level = math.sqrt(1.0 - up_x * up_x)
        lean_x, lean_y = -up_x * up_z / level, -up_y / level
        ahead, left, up = (
            level * ahead + up_x * up,
            lean_y * up_x * ahead + (up_z * level - lean_x * up_x) * left + up_y * up,
            lean_x * ahead + lean_y * left + up_z * up,
        )
    soft_xx, soft_xy, soft_yy = sensor[SOFT_IRON], sensor[SOFT_IRON + 1], sensor[SOFT_IRON + 2]
    field = (
        ahead + soft_xx * ahead + soft_xy * left,
        left + soft_xy * ahead + soft_yy * left,
        up,
    )
    for axis in range(3):
        noise = p[P_MAG_WHITE] * normal(seed, STREAM_MAGNETOMETER, tick, axis) if p[P_MAG_WHITE] > 0.0 else 0.0
        readings[MAG + axis] = field[axis] + sensor[HARD_IRON + axis] + noise


@kernel
def measure(
    world: Floats,
    sensor: Floats,
    p: Floats,
    steel: Floats,
    vertices: Floats,
    effects: Floats,
    seed: int,
    tick: int,
    readings: Floats,
) -> None:
    """Read every 100 Hz sensor once.

    Args:
        world: The true state after the tick's physics.
        sensor: (STATE_SIZE,) the sensors' own state, changed in place.
        p: (PARAMETER_SIZE,) noise figures.
        steel: (n, places.COLUMNS) magnetic places: field [T], reach [m].
        vertices: (m, 2) their outlines [m].
        effects: (effects.SIZE,) what faults do.
        seed: Of the scenario.
        tick: Onboard tick.
        readings: (interface.READINGS,) filled, SI units, body frame. Holds the readings of the tick before.
    """
    _inertial(world, sensor, p, effects, seed, tick, readings)
    _magnetic(world, sensor, p, steel, vertices, effects, seed, tick, readings)
    for actuator in range(ACTUATORS):
        angle, quantum = world[body.ANGLES + actuator], p[P_ENCODER_QUANTUM + actuator]
        if effects[e.ENCODER_OUT + actuator] > 0.0:
            sensor[MISSED + actuator] += angle - sensor[LAST_ANGLE + actuator]
        sensor[LAST_ANGLE + actuator] = angle
        angle -= sensor[MISSED + actuator]
        if quantum > 0.0:
            angle = math.floor((angle + sensor[ENCODER_PHASE + actuator]) / quantum) * quantum
        readings[ANGLES + actuator] = angle
