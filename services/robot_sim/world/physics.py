"""Physics of a robot in steps of 1 ms: one kernel call per onboard tick.

A step is: the drive's response to its commands (`drives/`), then contacts with things (`objects/`), then the pose along
the mean of the old and the new speeds, then the tool (`tools/`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.core.random import STREAM_WANDER, normal
from touchline.services.robot_sim.world.body import (
    STANDS_MPS,
    STEP_S,
    STEPS,
    TRACE_EAST,
    TRACE_NORTH,
    TRACE_SPRAYING,
    BodyFigures,
    BodyState,
)
from touchline.services.robot_sim.world.drives.world_drive import actuate, begin_tick, roll_on
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.objects.contacts import press
from touchline.services.robot_sim.world.objects.things import Things
from touchline.services.robot_sim.world.objects.tick import begin_things, end_things
from touchline.services.robot_sim.world.patches import slip_here
from touchline.services.robot_sim.world.roughness import stance
from touchline.services.robot_sim.world.tools.world_tool import work

Floats = NDArray[np.float64]


class WorldFigures(NamedTuple):
    """Constants of one robot in one scenario."""

    body: BodyFigures
    drive: Any
    """Constants `WorldDrive.figures`: their type decides which drive's kernels `advance` is compiled with."""
    tool: Any
    """Constants `WorldTool.figures`, as `drive`."""
    waves: Floats
    """Shape of the ground, of `shape_of`."""
    patches: Floats
    """Map of the slip, of `patches_of`."""


class WorldArrays(NamedTuple):
    """True state and constants of one robot; made once."""

    figures: WorldFigures
    state: Sequence[BodyState]
    """State of the body, (1,)."""
    drive: Sequence[Any]
    """State of the drive, (1,) `WorldDrive.state`."""
    trace: Floats
    """Tool's point during the last tick, `body.TRACE_SHAPE`."""
    seed: int
    """Seed of the scenario."""
    things: Things
    """Things around the robot."""


class HeldCommand(NamedTuple):
    """Command during a tick."""

    actuators: Floats
    """Commands (actuators,) of the drive, in the units of `DriveSpec.actuators`."""
    valve: bool
    """True for open."""
    disc: bool
    """True for down."""
    valve_after_s: float
    """Time into the tick at which the valve takes this state; before that it has the opposite one."""


@kernel
def leaning(state: BodyState, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Compute the place of a point of the body as the robot leans: ahead, to the left and up on the map [m].

    The body's axes in the map, turned back by the heading: x is the vertical's complement in the plane of heading and
    vertical, y is perpendicular to both.

    Args:
        state: State of the body with the vertical in body axes.
        x: Forward, body frame [m].
        y: To the left, body frame [m].
        z: Up, body frame [m].
    """
    if state.up_z == 1.0:
        return x, y, z
    up_x, up_y, up_z = state.up_x, state.up_y, state.up_z
    level = math.sqrt(1.0 - up_x * up_x)
    ahead = level * x - (up_x * up_y * y + up_x * up_z * z) / level
    return ahead, (up_z * y - up_y * z) / level, up_x * x + up_y * y + up_z * z


@kernel
def _trace_row(
    state: BodyState, body: BodyFigures, cos: float, sin: float, width: float, trace: Floats, row: int
) -> None:
    x, y, _ = leaning(state, body.point_x_m, body.point_y_m, 0.0)
    trace[row, TRACE_EAST] = state.east_m + cos * x - sin * y + body.drift_east_m
    trace[row, TRACE_NORTH] = state.north_m + sin * x + cos * y + body.drift_north_m
    trace[row, TRACE_SPRAYING] = width


@kernel
def tilt(state: BodyState, body: BodyFigures, waves: Floats) -> None:
    """Update the vertical in body axes on this slope at this heading, and the height above the origin's plane.

    The robot stands on the plane: x is level except for the grade along the heading, and the vertical is the plane's
    normal seen from the body. On rough ground it is the plane through the places where it stands.

    Args:
        state: State of the body; vertical and height are updated.
        body: Gives the grade and the direction uphill.
        waves: Shape of the ground.
    """
    rough = len(waves) > 0
    if body.grade == 0.0 and not rough:
        state.up_x, state.up_y, state.up_z, state.height_m = 0.0, 0.0, 1.0, 0.0
        return
    cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
    ahead = body.grade * (cos * body.uphill_east + sin * body.uphill_north)
    left = body.grade * (cos * body.uphill_north - sin * body.uphill_east)
    height = 0.0
    if rough:
        rough_ahead, rough_left, height = stance(waves, state.east_m, state.north_m, cos, sin)
        ahead += rough_ahead
        left += rough_left
    state.up_z = 1.0 / math.sqrt(1.0 + ahead * ahead + left * left)
    level = 1.0 / math.sqrt(1.0 + ahead * ahead)
    state.up_x = ahead * level
    state.up_y = left * state.up_z * level
    rise = body.grade * (state.east_m * body.uphill_east + state.north_m * body.uphill_north)
    state.height_m = rise + height if rough else rise


@kernel
def _shake(state: BodyState, up: tuple[float, float], height: float, duration: float) -> None:
    """Update the rates about x and y and the vertical acceleration of a robot on rough ground, means over a tick.

    The vertical u is fixed: in body axes it changes by u × ω.

    Args:
        state: State at the end of the tick.
        up: Vertical in body axes at its begin, x and y.
        height: Height at its begin [m].
        duration: Of the tick [s].
    """
    up_x, up_y = 0.5 * (up[0] + state.up_x), 0.5 * (up[1] + state.up_y)
    yaw_rate = state.mean_yaw_rate_radps
    state.mean_roll_rate_radps = ((state.up_y - up[1]) / duration + yaw_rate * up_x) / state.up_z
    state.mean_pitch_rate_radps = (yaw_rate * up_y - (state.up_x - up[0]) / duration) / state.up_z
    climb = (state.height_m - height) / duration
    state.mean_accel_z_mps2 = (climb - state.climb_mps) / duration
    state.climb_mps = climb


@kernel
def _wander(state: BodyState, body: BodyFigures, seed: int, tick: int) -> float:
    """Return the angle of the motion beyond the heading in a tick, and advance its random part.

    That is a first-order Gauss-Markov process over the distance, as the slip of wheels over time.
    """
    if body.wander_rad > 0.0:
        decay = math.exp(-abs(state.speed_mps) * STEPS * STEP_S * body.wander_1pm)
        fresh = body.wander_rad * math.sqrt(1.0 - decay * decay)
        state.wander_rad = decay * state.wander_rad + fresh * normal(seed, STREAM_WANDER, tick, 0)
    angle: float = body.crab_rad + state.wander_rad
    return angle


@kernel
def _turned(cos: float, sin: float, angle: float) -> tuple[float, float]:
    """Turn a unit vector by the little that a robot turns in half a step: series exact to rounding below 0.05 rad."""
    square = angle * angle
    by_cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0))
    by_sin = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)))
    return cos * by_cos - sin * by_sin, sin * by_cos + cos * by_sin


@kernel
def _move(state: BodyState, body: BodyFigures, cos: float, sin: float, speed: float, side: float) -> None:
    """Move the position by one step along these mean speeds; on a slope the distance uphill is shorter on the map.

    Args:
        state: State of the body; the position is updated.
        body: Gives the slope.
        cos: Cosine of the mean course.
        sin: Its sine.
        speed: Mean speed along it [m/s].
        side: Mean speed to its left [m/s].
    """
    east = (speed * cos - side * sin) * STEP_S
    north = (speed * sin + side * cos) * STEP_S
    if body.grade != 0.0:
        lost = 1.0 - 1.0 / math.sqrt(1.0 + body.grade * body.grade)
        uphill = lost * (east * body.uphill_east + north * body.uphill_north)
        east -= uphill * body.uphill_east
        north -= uphill * body.uphill_north
    state.east_m += east
    state.north_m += north


@kernel
def _withheld(usable: float, reserve: float, most: float, full: float) -> tuple[float, float]:
    """Withhold what exceeds `most`, once; it is returned when there is no such limit any more."""
    if most >= full:
        return usable + reserve, 0.0
    if usable > most:
        return most, reserve + (usable - most)
    return usable, reserve


@kernel
def _charge(state: BodyState, body: BodyFigures, duration: float) -> None:
    """Charge the battery if the robot stands at a dock; the power drawn is then less than 0."""
    if abs(state.speed_mps) > STANDS_MPS:
        return
    for k in range(len(body.docks)):
        x, y, reach, power = body.docks[k]
        room_wh = body.battery_wh - state.battery_reserve_wh - state.battery_wh
        if math.hypot(state.east_m - x, state.north_m - y) <= reach and room_wh > 0.0:
            gained_wh = min(power * duration / 3600.0, room_wh)
            state.battery_wh += gained_wh
            state.power_w -= gained_wh * 3600.0 / duration
            return


@kernel
def advance(world: WorldArrays, command: HeldCommand, faults: Sequence[Effects], tick: int) -> None:
    """Advance the world by one onboard tick of ten 1 ms steps, in place.

    Args:
        world: Its state is changed; its trace is filled with the tool's positions, map frame [m], and the share of its
            width on which it works.
        command: Command during the tick.
        faults: (1,) effects of faults.
        tick: Onboard tick, the counter of the randomness.
    """
    body, drive, tool, waves, patches = world.figures
    state, own, effects, trace = world.state[0], world.drive[0], faults[0], world.trace
    begin_tick(drive, own, body, world.seed, tick)
    full_wh = body.battery_wh
    state.tank_l, state.tank_reserve_l = _withheld(state.tank_l, state.tank_reserve_l, effects.tank_max_l, math.inf)
    state.battery_wh, state.battery_reserve_wh = _withheld(
        state.battery_wh, state.battery_reserve_wh, effects.battery_share * full_wh, full_wh
    )
    mass = body.mass_kg + body.load_kgpl * (state.tank_l + state.tank_reserve_l)
    tilt(state, body, waves)
    up_before, height_before = (state.up_x, state.up_y), state.height_m
    crab = _wander(state, body, world.seed, tick)
    if len(patches):
        slip_here(state, patches)
    speed_before, side_before, heading_before = state.speed_mps, state.side_speed_mps, state.heading_rad
    turned_x, turned_y, energy_j = 0.0, 0.0, 0.0
    cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
    crab_cos, crab_sin = math.cos(crab), math.sin(crab)
    _trace_row(state, body, cos, sin, 0.0, trace, 0)
    met = begin_things(world.things, world.state, world.seed, tick)
    late = math.floor(command.valve_after_s / STEP_S + 0.5)
    for step in range(STEPS):
        speed, side, yaw_rate = state.speed_mps, state.side_speed_mps, state.yaw_rate_radps
        energy_j += (body.idle_w + actuate(drive, state, own, body, effects, command.actuators)) * STEP_S
        roll_on(drive, state, own, body, effects, mass)
        if met and press(world.things, state, body, mass, tick):  # moved by its new speeds alone, nothing gets in
            speed, side, yaw_rate = state.speed_mps, state.side_speed_mps, state.yaw_rate_radps
        speed, side = 0.5 * (speed + state.speed_mps), 0.5 * (side + state.side_speed_mps)
        yaw_rate = 0.5 * (yaw_rate + state.yaw_rate_radps)
        half = 0.5 * yaw_rate * STEP_S
        cos, sin = _turned(cos, sin, half)
        _move(state, body, cos * crab_cos - sin * crab_sin, sin * crab_cos + cos * crab_sin, speed, side)
        state.heading_rad += 2.0 * half
        if step < STEPS - 1:
            cos, sin = _turned(cos, sin, half)
        else:  # to the bit where the next tick begins
            cos, sin = math.cos(state.heading_rad), math.sin(state.heading_rad)
        turned_x -= side * yaw_rate
        turned_y += speed * yaw_rate
        width = work(tool, state, effects, command.valve == (step >= late), command.disc)
        _trace_row(state, body, cos, sin, width, trace, step + 1)
    duration = STEPS * STEP_S
    state.power_w = energy_j / duration
    state.battery_wh = max(state.battery_wh - energy_j / 3600.0, 0.0)
    if len(body.docks):
        _charge(state, body, duration)
    state.mean_yaw_rate_radps = (state.heading_rad - heading_before) / duration
    state.mean_accel_x_mps2 = (state.speed_mps - speed_before) / duration + turned_x / STEPS + GRAVITY_MPS2 * state.up_x
    state.mean_accel_y_mps2 = (
        (state.side_speed_mps - side_before) / duration + turned_y / STEPS + GRAVITY_MPS2 * state.up_y
    )
    tilt(state, body, waves)
    if len(waves) > 0:
        _shake(state, up_before, height_before, duration)
    end_things(world.things, state, tick)
