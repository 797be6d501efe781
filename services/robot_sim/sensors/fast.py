"""The 100 Hz sensors: IMU, magnetometer, encoders.

IMU: the mean rate and specific force over the tick, white noise from the density, a turn-on bias drawn once per seed, a
bias random walk and a bias that grows as the sensor warms up. Magnetometer: the earth's field (declination 0, stated
dip) and that of steel near by, turned into the body, through soft iron, plus hard iron, a slowly varying disturbance of
the surroundings and white noise. Encoders: the cumulative angle of each actuator floored to whole counts, so that no
fraction is ever lost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.core.random import (
    STREAM_ENCODER,
    STREAM_FAULT,
    STREAM_IMU,
    STREAM_MAGNETOMETER,
    normal,
    uniform,
)
from touchline.core.records import Record
from touchline.onboard.interface import ACTUATORS, ANGLES, GYRO, MAG, TICK_S
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.zones import Zones, distance
from touchline.services.robot_sim.world.body import BodyState

_TURN_ON = -1  # the "tick" that keys what is drawn once

Floats = NDArray[np.float64]


class FastFigures(Record):
    """Of one robot in one scenario; standard deviations if not said otherwise."""

    gyro_white_radps: float
    """Per sample."""
    gyro_bias_radps: float
    """At turn-on."""
    gyro_walk_radps: float
    """Per tick."""
    gyro_warmth_radps_per_k: float
    accel_white_mps2: float
    accel_bias_mps2: float
    accel_walk_mps2: float
    accel_warmth_mps2_per_k: float
    warming_k: float
    """By how much the IMU gets warmer in the end."""
    warming_tau_s: float
    field_horizontal_t: float
    """The earth's."""
    field_down_t: float
    mag_white_t: float
    """Per sample."""
    hard_iron_t: float
    """Per axis."""
    soft_iron: float
    disturbance_t: float
    """Per axis."""
    disturbance_decay: float
    """Per tick."""
    encoder_rad: Annotated[Floats, ACTUATORS]
    """Of each actuator, the angle of one count; 0: not quantised."""


class FastSensors(Record):
    """Their state."""

    figures: FastFigures
    bias: Annotated[Floats, 6]
    """Gyro x, y, z [rad/s], accelerometer x, y, z [m/s²]."""
    warmth: Annotated[Floats, 6]
    """Of the same, per kelvin."""
    hard_iron_t: Annotated[Floats, 3]
    """Body frame."""
    soft_iron: Annotated[Floats, 3]
    """xx, xy, yy: gains less 1, cross-gain."""
    disturbance_t: Annotated[Floats, 3]
    """East, north, up, in the map frame."""
    phase_rad: Annotated[Floats, ACTUATORS]
    """Of each actuator: where between two counts its encoder stood at switch-on."""
    missed_rad: Annotated[Floats, ACTUATORS]
    """What an encoder that dropped out did not count."""
    last_rad: Annotated[Floats, ACTUATORS]
    """True angle in the tick before."""


@kernel
def switch_on(sensors: Sequence[FastSensors], seed: int) -> None:
    """Draw what is fixed at turn-on: biases, iron, disturbance, encoder phase.

    Args:
        sensors: (1,) with their figures; the rest is filled in.
        seed: Of the scenario.
    """
    s, f = sensors[0], sensors[0].figures
    for axis in range(3):
        s.bias[axis] = f.gyro_bias_radps * normal(seed, STREAM_IMU, _TURN_ON, axis)
        s.bias[3 + axis] = f.accel_bias_mps2 * normal(seed, STREAM_IMU, _TURN_ON, 3 + axis)
        s.warmth[axis] = f.gyro_warmth_radps_per_k * normal(seed, STREAM_IMU, _TURN_ON, 6 + axis)
        s.warmth[3 + axis] = f.accel_warmth_mps2_per_k * normal(seed, STREAM_IMU, _TURN_ON, 9 + axis)
        s.hard_iron_t[axis] = f.hard_iron_t * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, axis)
        s.disturbance_t[axis] = f.disturbance_t * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, 3 + axis)
        s.soft_iron[axis] = f.soft_iron * normal(seed, STREAM_MAGNETOMETER, _TURN_ON, 6 + axis)
    for actuator in range(len(s.phase_rad)):
        phase = uniform(seed, STREAM_ENCODER, _TURN_ON, actuator)
        s.phase_rad[actuator] = f.encoder_rad[actuator] * phase


@kernel
def _inertial(moment: Moment, sensors: Sequence[FastSensors], readings: Floats) -> None:
    seed, tick, state, effects = moment.seed, moment.tick, moment.state[0], moment.effects[0]
    s, f = sensors[0], sensors[0].figures
    warmer = f.warming_k * (1.0 - math.exp(-TICK_S * tick / f.warming_tau_s))
    truth = (
        0.0,
        0.0,
        state.mean_yaw_rate_radps + effects.gyro_bias_radps,
        state.mean_accel_x_mps2 + effects.accel_bias_mps2,
        state.mean_accel_y_mps2,
        GRAVITY_MPS2 * state.up_z,
    )
    for axis in range(6):
        gyro = axis < 3
        walk = f.gyro_walk_radps if gyro else f.accel_walk_mps2
        if walk > 0.0:
            s.bias[axis] += walk * normal(seed, STREAM_IMU, tick, 6 + axis)
        reading = truth[axis] + s.bias[axis] + warmer * s.warmth[axis]
        sigma = f.gyro_white_radps if gyro else f.accel_white_mps2
        if sigma > 0.0:
            reading += sigma * normal(seed, STREAM_IMU, tick, axis)
        shaken = effects.gyro_white_radps if gyro else effects.accel_white_mps2
        if shaken > 0.0:
            reading += shaken * normal(seed, STREAM_FAULT, tick, 3 + axis)
        if not effects.imu_stuck:
            readings[GYRO + axis] = reading


@kernel
def _steel(state: BodyState, steel: Zones) -> tuple[float, float]:
    """The field of steel near by, map frame (east, north) [T]."""
    east, north = 0.0, 0.0
    for index in range(len(steel.places)):
        place = steel.places[index]
        outline = place.outline
        away = distance(outline, steel.vertices, state.east_m, state.north_m)
        strength = place.field_t / (1.0 + away / place.reach_m) ** 3
        dx, dy = outline.centre_x_m - state.east_m, outline.centre_y_m - state.north_m
        length = math.hypot(dx, dy)
        if length > 1e-6:
            east += strength * dx / length
            north += strength * dy / length
    return east, north


@kernel
def _magnetic(moment: Moment, sensors: Sequence[FastSensors], steel: Zones, readings: Floats) -> None:
    seed, tick, state, effects = moment.seed, moment.tick, moment.state[0], moment.effects[0]
    s, f = sensors[0], sensors[0].figures
    if f.disturbance_t > 0.0:
        fresh = f.disturbance_t * math.sqrt(1.0 - f.disturbance_decay * f.disturbance_decay)
        for axis in range(3):
            draw = normal(seed, STREAM_MAGNETOMETER, tick, 3 + axis)
            s.disturbance_t[axis] = f.disturbance_decay * s.disturbance_t[axis] + fresh * draw
    steel_east, steel_north = _steel(state, steel)
    east = s.disturbance_t[0] + steel_east + effects.field_east_t
    north = f.field_horizontal_t + s.disturbance_t[1] + steel_north + effects.field_north_t
    up = s.disturbance_t[2] - f.field_down_t
    cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
    ahead, left = cos * east + sin * north, cos * north - sin * east
    if state.up_z < 1.0:  # on a slope the body's axes lean
        up_x, up_y, up_z = state.up_x, state.up_y, state.up_z
        level = math.sqrt(1.0 - up_x * up_x)
        lean_x, lean_y = -up_x * up_z / level, -up_y / level
        ahead, left, up = (
            level * ahead + up_x * up,
            lean_y * up_x * ahead + (up_z * level - lean_x * up_x) * left + up_y * up,
            lean_x * ahead + lean_y * left + up_z * up,
        )
    soft_xx, soft_xy, soft_yy = s.soft_iron[0], s.soft_iron[1], s.soft_iron[2]
    field = (
        ahead + soft_xx * ahead + soft_xy * left,
        left + soft_xy * ahead + soft_yy * left,
        up,
    )
    for axis in range(3):
        noise = f.mag_white_t * normal(seed, STREAM_MAGNETOMETER, tick, axis) if f.mag_white_t > 0.0 else 0.0
        readings[MAG + axis] = field[axis] + s.hard_iron_t[axis] + noise


@kernel
def measure(moment: Moment, sensors: Sequence[FastSensors], steel: Zones, readings: Floats) -> None:
    """Read every 100 Hz sensor once.

    White noise, random walk and exponentially correlated noise of the IMU are those of IEEE Std 952-1997, annex C: a
    density N [unit/√Hz] is N/√(10 ms) per sample, a walk K [unit/√s] is K·√(10 ms) per tick. The magnetometer reads
    (1 + S)·B + h, S soft and h hard iron (T. Ozyagcilar, "Calibrating an eCompass in the Presence of Hard- and
    Soft-Iron Interference", Freescale AN4246).

    Args:
        moment: That is measured.
        sensors: (1,) their state, changed.
        steel: Of `SteelPlace`.
        readings: (interface.READINGS,) filled, SI units, body frame. Holds the readings of the tick before.
    """
    _inertial(moment, sensors, readings)
    _magnetic(moment, sensors, steel, readings)
    state, effects, s = moment.state[0], moment.effects[0], sensors[0]
    for actuator in range(len(s.last_rad)):
        angle, quantum = state.angles_rad[actuator], s.figures.encoder_rad[actuator]
        if effects.encoder_out[actuator]:
            s.missed_rad[actuator] += angle - s.last_rad[actuator]
        s.last_rad[actuator] = angle
        angle -= s.missed_rad[actuator]
        if quantum > 0.0:
            angle = math.floor((angle + s.phase_rad[actuator]) / quantum) * quantum
        readings[ANGLES + actuator] = angle
