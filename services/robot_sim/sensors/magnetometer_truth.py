"""Emulated magnetometer: the earth's field and that of steel nearby, through soft and hard iron, with noise.

The earth's field has declination 0 and the dip of northern Denmark. Beside the white noise there is a disturbance by
the surroundings that varies slowly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import STREAM_MAGNETOMETER, normal
from touchline.core.records import Record
from touchline.onboard.interface import MAG, TICK_S
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.sensors.moment import TURN_ON_TICK, Moment
from touchline.services.robot_sim.sensors.zones import PlaceOutline, Zones, distance, make_zones
from touchline.services.robot_sim.world.body import BodyState

FIELD_HORIZONTAL_T: Final = 17.2e-6
"""Horizontal component of the earth's field in northern Denmark."""
FIELD_DOWN_T: Final = 47.6e-6
"""Downward component there: a dip of 70°."""

# Channels of STREAM_MAGNETOMETER, one for each axis.
_WHITE: Final = 0
_DISTURBANCE: Final = 3
# Those in the tick of turn-on, beside _DISTURBANCE:
_HARD_IRON: Final = 0
_SOFT_IRON: Final = 6

Floats = NDArray[np.float64]


class SteelPlace(Record):
    """Magnetic object of the scenario."""

    outline: PlaceOutline
    field_t: float
    """Field at its outline."""
    reach_m: float
    """Distance over which that field falls."""


class MagnetometerFigures(Record):
    """Field and noise figures of one magnetometer in one scenario, standard deviations where not said otherwise."""

    field_horizontal_t: float
    """Component of the earth's field to the north (a fixed value)."""
    field_down_t: float
    """Its downward component (a fixed value)."""
    white_t: float
    """White noise per sample and axis."""
    hard_iron_t: float
    """Hard iron per axis."""
    soft_iron: float
    """Soft iron, relative to the field."""
    disturbance_t: float
    """Disturbance per axis."""
    disturbance_decay: float
    """Share of the disturbance that is left after a tick (a fixed value)."""


class MagnetometerState(Record):
    """State of the magnetometer."""

    figures: MagnetometerFigures
    hard_iron_t: Annotated[Floats, 3]
    """Hard iron, body frame."""
    soft_iron: Annotated[Floats, 3]
    """Soft iron: gain of x less 1, cross gain, gain of y less 1."""
    disturbance_t: Annotated[Floats, 3]
    """Disturbance east, north, up, map frame."""


@kernel
def switch_on(magnetometer: Sequence[MagnetometerState], seed: int) -> None:
    """Draw what the sensor has at turn-on: hard and soft iron, and the first disturbance.

    Args:
        magnetometer: (1,) state with its figures; the rest is filled in.
        seed: Seed of the scenario.
    """
    s, f = magnetometer[0], magnetometer[0].figures
    for axis in range(3):
        s.hard_iron_t[axis] = f.hard_iron_t * normal(seed, STREAM_MAGNETOMETER, TURN_ON_TICK, _HARD_IRON + axis)
        s.disturbance_t[axis] = f.disturbance_t * normal(seed, STREAM_MAGNETOMETER, TURN_ON_TICK, _DISTURBANCE + axis)
        s.soft_iron[axis] = f.soft_iron * normal(seed, STREAM_MAGNETOMETER, TURN_ON_TICK, _SOFT_IRON + axis)


@kernel
def _steel_field(state: BodyState, steel: Zones) -> tuple[float, float]:
    """Field of the steel nearby, map frame (east, north) [T]."""
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
def measure(moment: Moment, magnetometer: Sequence[MagnetometerState], steel: Zones, readings: Floats) -> None:
    """Measure the magnetic field at the end of a tick.

    The reading is (1 + S)·B + h, with S soft and h hard iron (T. Ozyagcilar, "Calibrating an eCompass in the Presence
    of Hard- and Soft-Iron Interference", Freescale AN4246). The disturbance is exponentially correlated noise (IEEE Std
    952-1997, annex C).

    Args:
        moment: End of the tick.
        magnetometer: (1,) state, updated.
        steel: Places of kind `SteelPlace`.
        readings: (READINGS,) of `onboard/interface.py`; the field [T], body frame, is filled in.
    """
    seed, tick, state, effects = moment.seed, moment.tick, moment.state[0], moment.effects[0]
    s, f = magnetometer[0], magnetometer[0].figures
    if f.disturbance_t > 0.0:
        fresh = f.disturbance_t * math.sqrt(1.0 - f.disturbance_decay * f.disturbance_decay)
        for axis in range(3):
            draw = normal(seed, STREAM_MAGNETOMETER, tick, _DISTURBANCE + axis)
            s.disturbance_t[axis] = f.disturbance_decay * s.disturbance_t[axis] + fresh * draw
    steel_east, steel_north = _steel_field(state, steel)
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
        noise = f.white_t * normal(seed, STREAM_MAGNETOMETER, tick, _WHITE + axis) if f.white_t > 0.0 else 0.0
        readings[MAG + axis] = field[axis] + s.hard_iron_t[axis] + noise


def make_magnetometer(scenario: Scenario) -> MagnetometerState:
    """Make a magnetometer that has just been switched on.

    Args:
        scenario: Effective scenario, which has the noise.
    """
    noise, made = scenario.magnetometer, MagnetometerState()
    made.figures.reset(
        field_horizontal_t=FIELD_HORIZONTAL_T,
        field_down_t=FIELD_DOWN_T,
        white_t=noise.white_rad * FIELD_HORIZONTAL_T,
        hard_iron_t=noise.bias_rad * FIELD_HORIZONTAL_T,
        soft_iron=noise.soft_iron_relative,
        disturbance_t=noise.disturbance_rad * FIELD_HORIZONTAL_T,
        disturbance_decay=math.exp(-TICK_S / noise.disturbance_tau_s),
    )
    switch_on(made.array, scenario.seed)
    made.hard_iron_t[:2] += scenario.truth.hard_iron_x_t, scenario.truth.hard_iron_y_t
    return made


def steel_of(scenario: Scenario) -> Zones:
    """Make the scenario's places of kind `SteelPlace`."""
    return make_zones(SteelPlace, ((steel.outline, (steel.field_t, steel.reach_m)) for steel in scenario.steel))
