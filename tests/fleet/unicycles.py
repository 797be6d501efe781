"""Compiled: robots that turn on the spot and gain speed at a limited rate, driven by the cells' rule of motion.

The rule: a step is taken only if afterwards the position and the point where braking would end are in the cell; else
the robot brakes straight ahead. In a half-plane in which it does not stand, it may be where it is, but no farther out.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.angles import wrapped
from touchline.services.core.arcs import unit
from touchline.services.core.jit import kernel
from touchline.services.fleet.kernels.clipping import NORMAL_X, NORMAL_Y, OFFSET

Floats = NDArray[np.float64]
# Columns of a robot's state: position (m), heading (rad), speed (m/s, at least 0).
X, Y, HEADING, SPEED = range(4)
# Turning: the rate per radian of bearing (1/s), and the bearing beyond which it turns on the spot (rad).
TURN_1PS, ASIDE_RAD = 4.0, 0.8
# This near to its target it stands (m).
THERE_M = 0.002


class UnicycleLimits(NamedTuple):
    """What a robot can do."""

    speed_max_mps: float = 0.5
    acceleration_mps2: float = 0.5
    yaw_rate_max_radps: float = 2.0


@kernel
def permitted(rows: Floats, here: complex, after: complex, stop: complex) -> bool:
    """Whether a robot may be there, by the rule of motion.

    Args:
        rows: (k, 3) half-planes of its cell.
        here: Where it is (m).
        after: Where it would be (m).
        stop: Where it would stand if it braked from there (m).
    """
    for k in range(len(rows)):
        x, y = rows[k, NORMAL_X], rows[k, NORMAL_Y]
        limit = max(rows[k, OFFSET], x * here.real + y * here.imag)
        if x * after.real + y * after.imag > limit or x * stop.real + y * stop.imag > limit:
            return False
    return True


@kernel
def brake(state: Floats, deceleration: float, tick_s: float) -> None:
    """One tick of braking straight ahead.

    Args:
        state: (4,) X to SPEED; overwritten.
        deceleration: m/s².
        tick_s: s.
    """
    speed = state[SPEED]
    braked_s = min(tick_s, speed / deceleration)
    way = unit(state[HEADING]) * (speed - 0.5 * deceleration * braked_s) * braked_s
    state[X] += way.real
    state[Y] += way.imag
    state[SPEED] = max(speed - deceleration * tick_s, 0.0)


@kernel
def step(state: Floats, rows: Floats, target: Floats, limits: UnicycleLimits, tick_s: float) -> None:
    """One tick towards a target: at the wanted speed, else at less while turning, else braking straight ahead.

    Args:
        state: (4,) X to SPEED; overwritten.
        rows: (k, 3) half-planes of the robot's cell.
        target: (2,) m.
        limits: What it can do.
        tick_s: s.
    """
    here = complex(state[X], state[Y])
    way = complex(target[0], target[1]) - here
    far, speed = abs(way), state[SPEED]
    aside = wrapped(math.atan2(way.imag, way.real) - state[HEADING]) if far > THERE_M else 0.0
    rate = min(max(TURN_1PS * aside, -limits.yaw_rate_max_radps), limits.yaw_rate_max_radps)
    wanted = min(limits.speed_max_mps, 0.9 * math.sqrt(2.0 * limits.acceleration_mps2 * far)) * math.cos(aside)
    if far <= THERE_M or abs(aside) > ASIDE_RAD:
        wanted = 0.0
    gain = limits.acceleration_mps2 * tick_s
    for slower in range(2):
        asked = wanted if slower == 0 else 0.0
        after = min(max(asked, speed - gain, 0.0), speed + gain)
        moved = here + unit(state[HEADING] + 0.5 * rate * tick_s) * (0.5 * (speed + after) * tick_s)
        heading = state[HEADING] + rate * tick_s
        stop = moved + unit(heading) * (after * after / (2.0 * limits.acceleration_mps2))
        if permitted(rows, here, moved, stop):
            state[X], state[Y], state[HEADING], state[SPEED] = moved.real, moved.imag, heading, after
            return
    brake(state, limits.acceleration_mps2, tick_s)


@kernel
def drive(states: Floats, rows: Floats, targets: Floats, limits: UnicycleLimits, tick_s: float, ticks: int) -> float:
    """Drive all robots for some ticks.

    Args:
        states: (n, 4) X to SPEED; overwritten.
        rows: (n, k, 3) half-planes of the robots' cells.
        targets: (n, 2) m.
        limits: What each can do.
        tick_s: s.
        ticks: How many.

    Returns:
        The least distance (m) of two robots' centres at the end of any tick; inf if there is but one.
    """
    least = math.inf
    for _ in range(ticks):
        for i in range(len(states)):
            step(states[i], rows[i], targets[i], limits, tick_s)
        for i in range(len(states)):
            for j in range(i):
                x, y = states[i, X] - states[j, X], states[i, Y] - states[j, Y]
                least = min(least, x * x + y * y)
    return math.sqrt(least)
