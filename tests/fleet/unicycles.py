"""Compiled: robots that turn on the spot, gain speed at a limited rate, and do at once what they are commanded."""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.onboard.control.cell_steering import HEADING, SPEED, SteeringLimits, X, Y, steer_in_cell

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Complexes = NDArray[np.complex128]

LIMITS = SteeringLimits(
    speed_max_mps=0.5,
    acceleration_mps2=0.5,
    lateral_acceleration_mps2=math.inf,
    yaw_rate_max_radps=2.0,
    there_m=0.002,
    away_m=0.002,
)


@kernel
def move(motion: Floats, speed: float, rate: float, deceleration: float, tick_s: float) -> None:
    """One tick by a twist; who brakes until it stands does so in the time that takes.

    Args:
        motion: (4,) X to SPEED; overwritten.
        speed: At the end of the tick (m/s).
        rate: Of yaw (rad/s).
        deceleration: m/s².
        tick_s: s.
    """
    moving_s = tick_s if speed > 0.0 else min(tick_s, motion[SPEED] / deceleration)
    way = unit(motion[HEADING] + 0.5 * rate * tick_s) * (0.5 * (motion[SPEED] + speed) * moving_s)
    motion[X] += way.real
    motion[Y] += way.imag
    motion[HEADING] += rate * tick_s
    motion[SPEED] = speed


@kernel
def drive(
    states: Floats,
    rows: Floats,
    targets: Complexes,
    may_drive: Bools,
    limits: SteeringLimits,
    tick_s: float,
    ticks: int,
) -> float:
    """Drive all robots for some ticks.

    Args:
        states: (n, 4) X to SPEED; overwritten.
        rows: (n, k, 3) half-planes of the robots' cells.
        targets: (n,) x + iy (m).
        may_drive: (n,) the others brake straight ahead.
        limits: What each can do.
        tick_s: s.
        ticks: How many.

    Returns:
        The least distance (m) of two robots' centres at the end of any tick; inf if there is but one.
    """
    least, braking = math.inf, limits.acceleration_mps2
    for _ in range(ticks):
        for i in range(len(states)):
            speed, rate = max(states[i, SPEED] - braking * tick_s, 0.0), 0.0
            if may_drive[i]:
                speed, rate, _stands = steer_in_cell(states[i], False, rows[i], targets[i], limits, tick_s)
            move(states[i], speed, rate, braking, tick_s)
        for i in range(len(states)):
            for j in range(i):
                x, y = states[i, X] - states[j, X], states[i, Y] - states[j, Y]
                least = min(least, x * x + y * y)
    return math.sqrt(least)
