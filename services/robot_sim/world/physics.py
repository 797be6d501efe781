"""The 1 ms physics of a robot: one kernel call per onboard tick.

A step is: what the drive makes of its commands (`drives/`), then the pose along the mean of the old and the new speeds,
then the tool (`tools/`).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.core.physical_constants import GRAVITY_MPS2
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.body import (
    BATTERY_RESERVE_WH,
    BATTERY_WH,
    EAST,
    HEADING,
    HEIGHT,
    MEAN_ACCEL_X,
    MEAN_ACCEL_Y,
    MEAN_YAW_RATE,
    NORTH,
    P_BATTERY_WH,
    P_GRADE,
    P_IDLE_W,
    P_MASS,
    P_PAINT_KGPL,
    P_POINT_X,
    P_POINT_Y,
    P_UPHILL_EAST,
    P_UPHILL_NORTH,
    POWER_W,
    SIDE_SPEED,
    SPEED,
    STEP_S,
    STEPS,
    TANK_L,
    TANK_RESERVE_L,
    TRACE_EAST,
    TRACE_NORTH,
    TRACE_SPRAYING,
    UP_X,
    UP_Y,
    UP_Z,
    YAW_RATE,
)
from touchline.services.robot_sim.world.drives.world_drive import actuate, begin_tick, roll_on
from touchline.services.robot_sim.world.tools.world_tool import work

Floats = NDArray[np.float64]


class WorldArrays(NamedTuple):
    """All that is true about one robot; made once."""

    parts: tuple[Any, Any]
    """The drive's and the tool's kernels."""
    state: Floats
    """Indices in `body`, from `body.DRIVE` on those of the drive."""
    parameters: Floats
    """Of this vehicle and scenario; indices in `body`, from `body.P_DRIVE` on those of the drive."""
    trace: Floats
    """`body.TRACE_SHAPE`: the tool's point during the last tick."""
    seed: int
    """Of the scenario."""


class HeldCommand(NamedTuple):
    """What is commanded during a tick."""

    actuators: Floats
    """(interface.ACTUATORS,) of the drive, in the units of `DriveSpec.actuators`."""
    valve: bool
    """Open."""
    disc: bool
    """Down."""
    valve_after_s: float
    """How far into the tick the valve is to be so; before it is the opposite."""


@kernel
def leaning(state: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """How far a point of the body is ahead, to the left and up on the map, as the robot leans [m].

    The body's axes in the map, turned back by the heading: x is the vertical's complement in the plane of heading and
    vertical, y is across both.

    Args:
        state: The world's; of it `UP_X` … `UP_Z`, the vertical in body axes.
        x: Forward, body frame [m].
        y: To the left, body frame [m].
        z: Up, body frame [m].
    """
    if state[UP_Z] == 1.0:
        return x, y, z
    up_x, up_y, up_z = state[UP_X], state[UP_Y], state[UP_Z]
    level = math.sqrt(1.0 - up_x * up_x)
    ahead = level * x - (up_x * up_y * y + up_x * up_z * z) / level
    return ahead, (up_z * y - up_y * z) / level, up_x * x + up_y * y + up_z * z


@kernel
def _trace_row(state: Floats, p: Floats, cos: float, sin: float, width: float, row: Floats) -> None:
    x, y, _ = leaning(state, p[P_POINT_X], p[P_POINT_Y], 0.0)
    row[TRACE_EAST] = state[EAST] + cos * x - sin * y
    row[TRACE_NORTH] = state[NORTH] + sin * x + cos * y
    row[TRACE_SPRAYING] = width


@kernel
def tilt(state: Floats, p: Floats) -> None:
    """The vertical in body axes on this slope at this heading, and the height above the origin's plane.

    The robot stands on the plane: x is level but for the grade along the heading, and the vertical is the plane's
    normal seen from the body.

    Args:
        state: The world's; `UP_X` … `UP_Z` and `HEIGHT` are updated.
        p: The world's parameters; of them the grade and where it rises.
    """
    if p[P_GRADE] == 0.0:
        state[UP_X], state[UP_Y], state[UP_Z], state[HEIGHT] = 0.0, 0.0, 1.0, 0.0
        return
    cos, sin = math.cos(state[HEADING]), math.sin(state[HEADING])
    ahead = p[P_GRADE] * (cos * p[P_UPHILL_EAST] + sin * p[P_UPHILL_NORTH])
    left = p[P_GRADE] * (cos * p[P_UPHILL_NORTH] - sin * p[P_UPHILL_EAST])
    state[UP_Z] = 1.0 / math.sqrt(1.0 + ahead * ahead + left * left)
    level = 1.0 / math.sqrt(1.0 + ahead * ahead)
    state[UP_X] = ahead * level
    state[UP_Y] = left * state[UP_Z] * level
    state[HEIGHT] = p[P_GRADE] * (state[EAST] * p[P_UPHILL_EAST] + state[NORTH] * p[P_UPHILL_NORTH])


@kernel
def _move(state: Floats, p: Floats, speed: float, side: float, yaw_rate: float) -> None:
    """Move the pose by one step along these mean speeds; on a slope the map sees less of the distance uphill."""
    turn = yaw_rate * STEP_S
    cos, sin = math.cos(state[HEADING] + 0.5 * turn), math.sin(state[HEADING] + 0.5 * turn)
    east = (speed * cos - side * sin) * STEP_S
    north = (speed * sin + side * cos) * STEP_S
    if p[P_GRADE] != 0.0:
        lost = 1.0 - 1.0 / math.sqrt(1.0 + p[P_GRADE] * p[P_GRADE])
        uphill = lost * (east * p[P_UPHILL_EAST] + north * p[P_UPHILL_NORTH])
        east -= uphill * p[P_UPHILL_EAST]
        north -= uphill * p[P_UPHILL_NORTH]
    state[EAST] += east
    state[NORTH] += north
    state[HEADING] += turn


@kernel
def _withhold(state: Floats, usable: int, reserve: int, most: float, full: float) -> None:
    """Set aside what exceeds `most`, once; it comes back when there is no such limit any more."""
    if most >= full:
        state[usable] += state[reserve]
        state[reserve] = 0.0
    elif state[usable] > most:
        state[reserve] += state[usable] - most
        state[usable] = most


@kernel
def advance(world: WorldArrays, command: HeldCommand, effects: Floats, tick: int) -> None:
    """Advance the world by one onboard tick of ten 1 ms steps, in place.

    Args:
        world: Its state is changed; its trace is filled with the tool's positions, map frame [m], and the share of its
            width on which it works.
        command: Held over the tick.
        effects: (effects.SIZE,) what faults do.
        tick: Onboard tick, the counter of the randomness.
    """
    (drive, tool), state, p, trace, seed = world
    begin_tick(drive, state, p, seed, tick)
    full_wh = p[P_BATTERY_WH]
    _withhold(state, TANK_L, TANK_RESERVE_L, effects[e.TANK_MAX_L], math.inf)
    _withhold(state, BATTERY_WH, BATTERY_RESERVE_WH, effects[e.BATTERY_MAX] * full_wh, full_wh)
    mass = p[P_MASS] + p[P_PAINT_KGPL] * (state[TANK_L] + state[TANK_RESERVE_L])
    tilt(state, p)
    speed_before, side_before, heading_before = state[SPEED], state[SIDE_SPEED], state[HEADING]
    turned_x, turned_y, energy_j = 0.0, 0.0, 0.0
    _trace_row(state, p, math.cos(state[HEADING]), math.sin(state[HEADING]), 0.0, trace[0])
    late = math.floor(command.valve_after_s / STEP_S + 0.5)
    for step in range(STEPS):
        speed, side, yaw_rate = state[SPEED], state[SIDE_SPEED], state[YAW_RATE]
        energy_j += (p[P_IDLE_W] + actuate(drive, state, p, effects, command.actuators)) * STEP_S
        roll_on(drive, state, p, effects, mass)
        speed, side = 0.5 * (speed + state[SPEED]), 0.5 * (side + state[SIDE_SPEED])
        yaw_rate = 0.5 * (yaw_rate + state[YAW_RATE])
        _move(state, p, speed, side, yaw_rate)
        turned_x -= side * yaw_rate
        turned_y += speed * yaw_rate
        width = work(tool, state, p, effects, command.valve == (step >= late), command.disc)
        _trace_row(state, p, math.cos(state[HEADING]), math.sin(state[HEADING]), width, trace[step + 1])
    duration = STEPS * STEP_S
    state[POWER_W] = energy_j / duration
    state[BATTERY_WH] = max(state[BATTERY_WH] - energy_j / 3600.0, 0.0)
    state[MEAN_YAW_RATE] = (state[HEADING] - heading_before) / duration
    state[MEAN_ACCEL_X] = (state[SPEED] - speed_before) / duration + turned_x / STEPS + GRAVITY_MPS2 * state[UP_X]
    state[MEAN_ACCEL_Y] = (state[SIDE_SPEED] - side_before) / duration + turned_y / STEPS + GRAVITY_MPS2 * state[UP_Y]
    tilt(state, p)
