"""Motion of what moves by itself or rolls: velocities that it wants, and collisions among things."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing
from touchline.core.random import STREAM_OBJECTS, uniform
from touchline.onboard.interface import TICK_S
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.objects.solids import RADIUS, X1, X2, Y1, Y2, SolidGrid
from touchline.services.robot_sim.world.objects.things import (
    EAST,
    EAST_MPS,
    INTERCEPT,
    M_AHEAD,
    M_BEYOND,
    M_FIRST,
    M_HOLD,
    M_LOOP,
    M_MASS,
    M_MOTION,
    M_NEAR,
    M_NUMBER,
    M_POINTS,
    M_RADIUS,
    M_SPEED,
    M_START,
    NORTH,
    NORTH_MPS,
    PATH,
    PINNED_EAST,
    PINNED_NORTH,
    STAGE,
    STEP_IN_FRONT,
    TARGET_EAST,
    TARGET_NORTH,
    WANDER,
    Things,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_ARRIVED_M: Final = 0.1
_GIVE_UP_TICKS: Final = 2000  # a wanderer that is held up draws another target after so long
_STOPS_TICKS: Final = 200  # one who has run into the robot stands for so long,
_ASIDE_M: Final = 1.5  # and then steps aside: so far away from it, and so far to the left


@borrowing
def _draw_target(mover: Floats, figures: Floats, points: Floats, seed: int, tick: int) -> None:
    """Draw the next target of a wanderer in its rectangle."""
    corner, opposite = points[int(figures[M_FIRST])], points[int(figures[M_FIRST]) + 1]
    channel = 2 * int(figures[M_NUMBER])
    mover[TARGET_EAST] = corner[0] + (opposite[0] - corner[0]) * uniform(seed, STREAM_OBJECTS, tick, channel)
    mover[TARGET_NORTH] = corner[1] + (opposite[1] - corner[1]) * uniform(seed, STREAM_OBJECTS, tick, channel + 1)


@borrowing
def _aim_across(mover: Floats, figures: Floats, state: BodyState) -> None:
    """Set the target of one who steps in front of the robot: beyond a point on its way."""
    way = -1.0 if state.speed_mps < 0.0 else 1.0
    east = state.east_m + way * figures[M_AHEAD] * math.cos(state.heading_rad) - mover[EAST]
    north = state.north_m + way * figures[M_AHEAD] * math.sin(state.heading_rad) - mover[NORTH]
    distance = math.hypot(east, north)
    further = 1.0 + figures[M_BEYOND] / distance if distance > 0.0 else 1.0
    mover[TARGET_EAST], mover[TARGET_NORTH] = mover[EAST] + further * east, mover[NORTH] + further * north


@borrowing
def _stops(mover: Floats, figures: Floats, state: BodyState, touched: Integers, tick: int) -> bool:
    """Return whether a mover stands because it has run into the robot; only who intercepts it pushes on.

    In the end it steps aside, and then goes on: but not to the last point of a path, which it gives up.
    """
    motion = figures[M_MOTION]
    if touched[0] == 0 or tick - touched[0] > _STOPS_TICKS or motion == INTERCEPT:
        return False
    stood = (tick - touched[2]) % (2 * _STOPS_TICKS)
    if stood == _STOPS_TICKS:
        east, north = mover[EAST] - state.east_m, mover[NORTH] - state.north_m
        distance = math.hypot(east, north)
        if distance > 0.0:
            mover[TARGET_EAST] = mover[EAST] + _ASIDE_M * (east - north) / distance
            mover[TARGET_NORTH] = mover[NORTH] + _ASIDE_M * (north + east) / distance
        if motion == PATH and mover[STAGE] > 1.0:
            mover[STAGE] -= 1.0
    still: bool = stood < _STOPS_TICKS
    return still


@borrowing
def _choose_target(mover: Floats, figures: Floats, points: Floats, state: BodyState, seed: int, tick: int) -> bool:
    """Set the target of a mover in this tick; return False if it wants to stand."""
    motion, stage = figures[M_MOTION], int(min(max(mover[STAGE], 0.0), 1e9))
    east, north = mover[TARGET_EAST] - mover[EAST], mover[TARGET_NORTH] - mover[NORTH]
    arrived = east * east + north * north < _ARRIVED_M * _ARRIVED_M
    away = math.hypot(state.east_m - mover[EAST], state.north_m - mover[NORTH])
    if tick < figures[M_START]:
        return False
    if motion == PATH:
        count = int(figures[M_POINTS])
        if (stage > 0 and arrived and (stage < count or figures[M_LOOP] > 0.0)) or stage == 0:
            target = points[int(figures[M_FIRST]) + stage % count]
            mover[TARGET_EAST], mover[TARGET_NORTH], mover[STAGE] = target[0], target[1], stage + 1
            return True
        return not arrived
    if motion == WANDER:
        if stage == 0 or arrived or tick % _GIVE_UP_TICKS == 0:
            _draw_target(mover, figures, points, seed, tick)
            mover[STAGE] = 1.0
        return True
    if motion == STEP_IN_FRONT:
        if stage == 0:
            if away > figures[M_NEAR]:
                return False
            _aim_across(mover, figures, state)
            mover[STAGE] = 1.0
            return True
        return not arrived
    mover[TARGET_EAST], mover[TARGET_NORTH] = state.east_m, state.north_m
    walks: bool = motion == INTERCEPT and 0.0 < away <= figures[M_NEAR]
    return walks


@borrowing
def choose_velocities(things: Things, states: Sequence[BodyState], seed: int, tick: int) -> None:
    """Set the velocity that each mover wants in a tick.

    Args:
        things: Targets and wanted velocities are updated.
        states: (1,) true state of the robot.
        seed: Seed of the scenario.
        tick: Tick that begins.
    """
    for i in range(len(things.movers)):
        mover, figures, wanted = things.movers[i], things.figures[i], things.wanted[i]
        wanted[0] = wanted[1] = 0.0
        if _stops(mover, figures, states[0], things.touched[len(things.fixed) + i], tick):
            continue
        if _choose_target(mover, figures, things.points, states[0], seed, tick):
            east, north = mover[TARGET_EAST] - mover[EAST], mover[TARGET_NORTH] - mover[NORTH]
            distance = math.hypot(east, north)
            if distance > 0.0:
                speed = min(figures[M_SPEED], distance / TICK_S)
                wanted[0], wanted[1] = speed * east / distance, speed * north / distance


@borrowing
def hurry(things: Things, mover: int, duration_s: float) -> None:
    """Change a mover's velocity towards the wanted one, as its feet or the ground allow.

    Args:
        things: The mover's velocity is updated.
        mover: Its index.
        duration_s: Time that passes.
    """
    at, wanted = things.movers[mover], things.wanted[mover]
    east, north = wanted[0] - at[EAST_MPS], wanted[1] - at[NORTH_MPS]
    change = math.sqrt(east * east + north * north)
    most = things.figures[mover, M_HOLD] * duration_s
    share = most / change if change > most else 1.0
    at[EAST_MPS] += share * east
    at[NORTH_MPS] += share * north


@borrowing
def move_on(things: Things, mover: int, duration_s: float) -> None:
    """Move a mover on at its velocity, as `hurry`."""
    at = things.movers[mover]
    at[EAST] += at[EAST_MPS] * duration_s
    at[NORTH] += at[NORTH_MPS] * duration_s


@borrowing
def _push_out(mover: Floats, figures: Floats, solid: Floats) -> None:
    """Move a mover out of a solid, and take away its velocity into it."""
    ex, ey = solid[X2] - solid[X1], solid[Y2] - solid[Y1]
    x, y = mover[EAST] - solid[X1], mover[NORTH] - solid[Y1]
    square = ex * ex + ey * ey
    share = min(max((x * ex + y * ey) / square, 0.0), 1.0) if square > 0.0 else 0.0
    x, y = x - share * ex, y - share * ey
    distance, least = math.sqrt(x * x + y * y), figures[M_RADIUS] + solid[RADIUS]
    if distance >= least or distance == 0.0:
        return
    x, y = x / distance, y / distance
    mover[EAST] += (least - distance) * x
    mover[NORTH] += (least - distance) * y
    mover[PINNED_EAST], mover[PINNED_NORTH] = x, y
    into = mover[EAST_MPS] * x + mover[NORTH_MPS] * y
    if into < 0.0:
        mover[EAST_MPS] -= into * x
        mover[NORTH_MPS] -= into * y


@borrowing
def _keep_out(mover: Floats, figures: Floats, grid: SolidGrid, soft: Floats) -> None:
    """Keep a mover out of the fixed things round it."""
    if len(grid.items) == 0:
        return
    reach = figures[M_RADIUS]
    east, north = mover[EAST] - grid.corner[0], mover[NORTH] - grid.corner[1]
    west_cell = max(math.floor((east - reach) / grid.cell_m), 0)
    south_cell = max(math.floor((north - reach) / grid.cell_m), 0)
    east_cell = min(math.floor((east + reach) / grid.cell_m), grid.size[0] - 1)
    north_cell = min(math.floor((north + reach) / grid.cell_m), grid.size[1] - 1)
    for row in range(south_cell, north_cell + 1):
        for column in range(west_cell, east_cell + 1):
            cell = row * grid.size[0] + column
            for place in range(grid.first[cell], grid.first[cell + 1]):
                if soft[grid.items[place]] == 0.0:
                    _push_out(mover, figures, grid.solids[grid.items[place]])


@borrowing
def _part(one: Floats, other: Floats, one_figures: Floats, other_figures: Floats) -> None:
    """Move two movers apart that overlap; what one loses of its motion towards the other, that gains."""
    x, y = other[EAST] - one[EAST], other[NORTH] - one[NORTH]
    least = one_figures[M_RADIUS] + other_figures[M_RADIUS]
    square = x * x + y * y
    if square >= least * least or square == 0.0:
        return
    distance = math.sqrt(square)
    x, y = x / distance, y / distance
    share = other_figures[M_MASS] / (one_figures[M_MASS] + other_figures[M_MASS])
    one[EAST] -= share * (least - distance) * x
    one[NORTH] -= share * (least - distance) * y
    other[EAST] += (1.0 - share) * (least - distance) * x
    other[NORTH] += (1.0 - share) * (least - distance) * y
    closing = (one[EAST_MPS] - other[EAST_MPS]) * x + (one[NORTH_MPS] - other[NORTH_MPS]) * y
    if closing > 0.0:
        one[EAST_MPS] -= share * closing * x
        one[NORTH_MPS] -= share * closing * y
        other[EAST_MPS] += (1.0 - share) * closing * x
        other[NORTH_MPS] += (1.0 - share) * closing * y


@borrowing
def settle_collisions(things: Things) -> None:
    """Keep movers out of each other and out of fixed things, at the end of a tick."""
    movers, figures = things.movers, things.figures
    for i in range(len(movers)):
        for j in range(i):
            _part(movers[i], movers[j], figures[i], figures[j])
    for i in range(len(movers)):
        movers[i, PINNED_EAST] = movers[i, PINNED_NORTH] = 0.0
        _keep_out(movers[i], figures[i], things.grid, things.soft)


@borrowing
def walk(things: Things, mover: int, duration_s: float) -> None:
    """Move a mover by its own means: `hurry`, then `move_on`."""
    hurry(things, mover, duration_s)
    move_on(things, mover, duration_s)
