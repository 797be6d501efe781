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
    BodyFigures,
)
from touchline.services.robot_sim.world.drives.world_drive import actuate, begin_tick, roll_on
from touchline.services.robot_sim.world.tools.world_tool import work

Floats = NDArray[np.float64]


class WorldFigures(NamedTuple):
    """What is constant about one robot in one scenario."""

    body: BodyFigures
    drive: Any
    """Of `WorldDrive.figures`: its type decides which drive's kernels `advance` is compiled with."""
    tool: Any
    """Of `WorldTool.figures`, as `drive`."""


class WorldArrays(NamedTuple):
    """All that is true about one robot; made once."""

    figures: WorldFigures
    state: Floats
    """Indices in `body`, from `body.DRIVE` on those of the drive."""
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
def _trace_row(state: Floats, body: BodyFigures, cos: float, sin: float, width: float, row: Floats) -> None:
    x, y, _ = leaning(state, body.point_x_m, body.point_y_m, 0.0)
    row[TRACE_EAST] = state[EAST] + cos * x - sin * y
    row[TRACE_NORTH] = state[NORTH] + sin * x + cos * y
    row[TRACE_SPRAYING] = width


@kernel
def tilt(state: Floats, body: BodyFigures) -> None:
    """The vertical in body axes on this slope at this heading, and the height above the origin's plane.

    The robot stands on the plane: x is level but for the grade along the heading, and the vertical is the plane's
    normal seen from the body.

    Args:
        state: The world's; `UP_X` … `UP_Z` and `HEIGHT` are updated.
        body: Of its figures the grade and where it rises.
    """
    if body.grade == 0.0:
        state[UP_X], state[UP_Y], state[UP_Z], state[HEIGHT] = 0.0, 0.0, 1.0, 0.0
        return
    cos, sin = math.cos(state[HEADING]), math.sin(state[HEADING])
    ahead = body.grade * (cos * body.uphill_east + sin * body.uphill_north)
    left = body.grade * (cos * body.uphill_north - sin * body.uphill_east)
    state[UP_Z] = 1.0 / math.sqrt(1.0 + ahead * ahead + left * left)
    level = 1.0 / math.sqrt(1.0 + ahead * ahead)
    state[UP_X] = ahead * level
    state[UP_Y] = left * state[UP_Z] * level
    state[HEIGHT] = body.grade * (state[EAST] * body.uphill_east + state[NORTH] * body.uphill_north)


@kernel
def _move(state: Floats, body: BodyFigures, speed: float, side: float, yaw_rate: float) -> None:
    """Move the pose by one step along these mean speeds; on a slope the map sees less of the distance uphill."""
    turn = yaw_rate * STEP_S
    cos, sin = math.cos(state[HEADING] + 0.5 * turn), math.sin(state[HEADING] + 0.5 * turn)
    east = (speed * cos - side * sin) * STEP_S
    north = (speed * sin + side * cos) * STEP_S
    if body.grade != 0.0:
        lost = 1.0 - 1.0 / math.sqrt(1.0 + body.grade * body.grade)
        uphill = lost * (east * body.uphill_east + north * body.uphill_north)
        east -= uphill * body.uphill_east
        north -= uphill * body.uphill_north
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
    (body, drive, tool), state, trace, seed = world
    begin_tick(drive, state, body, seed, tick)
    full_wh = body.battery_wh
    _withhold(state, TANK_L, TANK_RESERVE_L, effects[e.TANK_MAX_L], math.inf)
    _withhold(state, BATTERY_WH, BATTERY_RESERVE_WH, effects[e.BATTERY_MAX] * full_wh, full_wh)
    mass = body.mass_kg + body.load_kgpl * (state[TANK_L] + state[TANK_RESERVE_L])
    tilt(state, body)
    speed_before, side_before, heading_before = state[SPEED], state[SIDE_SPEED], state[HEADING]
    turned_x, turned_y, energy_j = 0.0, 0.0, 0.0
    _trace_row(state, body, math.cos(state[HEADING]), math.sin(state[HEADING]), 0.0, trace[0])
    late = math.floor(command.valve_after_s / STEP_S + 0.5)
    for step in range(STEPS):
        speed, side, yaw_rate = state[SPEED], state[SIDE_SPEED], state[YAW_RATE]
        energy_j += (body.idle_w + actuate(drive, state, body, effects, command.actuators)) * STEP_S
        roll_on(drive, state, body, effects, mass)
        speed, side = 0.5 * (speed + state[SPEED]), 0.5 * (side + state[SIDE_SPEED])
        yaw_rate = 0.5 * (yaw_rate + state[YAW_RATE])
        _move(state, body, speed, side, yaw_rate)
        turned_x -= side * yaw_rate
        turned_y += speed * yaw_rate
        width = work(tool, state, effects, command.valve == (step >= late), command.disc)
        _trace_row(state, body, math.cos(state[HEADING]), math.sin(state[HEADING]), width, trace[step + 1])
    duration = STEPS * STEP_S
    state[POWER_W] = energy_j / duration
    state[BATTERY_WH] = max(state[BATTERY_WH] - energy_j / 3600.0, 0.0)
    state[MEAN_YAW_RATE] = (state[HEADING] - heading_before) / duration
    state[MEAN_ACCEL_X] = (state[SPEED] - speed_before) / duration + turned_x / STEPS + GRAVITY_MPS2 * state[UP_X]
    state[MEAN_ACCEL_Y] = (state[SIDE_SPEED] - side_before) / duration + turned_y / STEPS + GRAVITY_MPS2 * state[UP_Y]
    tilt(state, body)
