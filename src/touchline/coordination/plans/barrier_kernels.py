"""Kernels of barrier certificates: distances of plans that brake after a period, and how they change with commands.

A command is a speed and a yaw rate for a period, after which the robot brakes to rest.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.plans.plan_kernels import AreaBorders, PlanLimits, apart_squared_of, roll_out
from touchline.core.half_planes import NORMAL_X, NORMAL_Y, OFFSET
from touchline.core.jit import kernel
from touchline.core.polygons import apart_squared
from touchline.core.timed_motion import X, Y

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Columns of a command: speed (m/s), yaw rate (rad/s).
COMMAND = 2


@kernel
def roll_out_all(plans: Floats, commands: Floats, limits: PlanLimits) -> None:
    """Fill in plans (n, m, 5) from their first samples on, by commands (n, 2)."""
    for i in range(len(plans)):
        roll_out(plans[i], commands[i, 0], commands[i, 1], limits, plans.shape[1])


@kernel
def near_pairs(plans: Floats, range_m: float) -> Ints:
    """Return (p, 2) numbers of robots whose plans (n, m, 5) begin so near to each other."""
    found = np.empty((len(plans) * (len(plans) - 1) // 2, 2), np.int64)
    count = 0
    for i in range(len(plans)):
        for j in range(i):
            if math.hypot(plans[i, 0, X] - plans[j, 0, X], plans[i, 0, Y] - plans[j, 0, Y]) < range_m:
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


@kernel
def off_walls_m(plan: Floats, around: AreaBorders) -> float:
    """Return the least distance (m) of a plan (m, 5) from walls and sides of the area; inf without any."""
    least, square = math.inf, math.inf
    for s in range(len(around.sides)):
        x, y, offset = around.sides[s, NORMAL_X], around.sides[s, NORMAL_Y], around.sides[s, OFFSET]
        for k in range(len(plan)):
            least = min(least, offset - x * plan[k, X] - y * plan[k, Y])
    for w in range(len(around.walls)):
        a = complex(around.walls[w, 0], around.walls[w, 1])
        b = complex(around.walls[w, 2], around.walls[w, 3])
        for k in range(1, len(plan)):
            before, after = complex(plan[k - 1, X], plan[k - 1, Y]), complex(plan[k, X], plan[k, Y])
            square = min(square, apart_squared(before, after, a, b))
    return min(least, math.sqrt(square))


@kernel
def distances_m(plans: Floats, pairs: Ints, around: AreaBorders, found: Floats) -> None:
    """Fill in the least distance (m) of each pair of plans, and behind them that of the first n plans from walls.

    Args:
        plans: (n or more, m, 5).
        pairs: (p, 2) numbers of plans.
        around: Borders of the area.
        found: (p + n,) filled in.
    """
    p = len(pairs)
    for row in range(p):
        found[row] = math.sqrt(apart_squared_of(plans[pairs[row, 0]], plans[pairs[row, 1]], 0.0))
    for i in range(len(found) - p):
        found[p + i] = off_walls_m(plans[i], around)


@kernel
def slopes(
    braking: Floats, changed: Floats, step: float, pairs: Ints, around: AreaBorders, at: Floats, found: Floats
) -> None:
    """Fill in how distances change with one number of each robot's command, by differences from braking.

    Args:
        braking: (n or more, m, 5) plans if all brake; those behind the first n are fixed.
        changed: Plans if that number is larger.
        step: By how much.
        pairs: (p, 2) numbers of plans.
        around: Borders of the area.
        at: (p + n,) distances if all brake (m).
        found: (p + n, 2) filled in: derivative by the number of the first robot, and of the second.
    """
    p = len(pairs)
    for row in range(p):
        i, j = pairs[row]
        found[row, 0] = (math.sqrt(apart_squared_of(changed[i], braking[j], 0.0)) - at[row]) / step
        found[row, 1] = (math.sqrt(apart_squared_of(braking[i], changed[j], 0.0)) - at[row]) / step
    for i in range(len(at) - p):
        found[p + i, 0] = (off_walls_m(changed[i], around) - at[p + i]) / step if at[p + i] < math.inf else 0.0
        found[p + i, 1] = 0.0
