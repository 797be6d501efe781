"""Time-optimal path parametrisation (TOPP), compiled: the fastest speeds along cells of constant sharpness.

State is u = v² (m²/s²), linear in arc length within a cell (constant acceleration). What the drive can do of that is
said by drives/caps.py. A backward pass finds the fastest entries from which the rest can be
driven, a forward pass the fastest drive through them: the optimum on these cells, after Pham and Pham, "A new approach
to time-optimal path parameterization based on reachability analysis", IEEE T-RO 34(3), 2018.
"""

import math

import numpy as np

from touchline.services.core.jit import kernel
from touchline.services.planner.drives.caps import Caps, gain, spin_time, square_cap
from touchline.services.planner.geometry.clothoid import Floats

# A cell of a clothoid changes curvature by at most this (1/m): its speed is capped for the tighter end.
CELL_CURVATURE_1PM = 0.15
# What it costs to slow down a painted line next to a transition.
SLOWED_S_PER_MPS, SPEED_SLACK_MPS = 30.0, 1e-6


@kernel
def sweep(length: Floats, curvature: Floats, sharpness: Floats, cap: Floats, limits: Caps, square: Floats) -> None:
    """Lower `square`, u at the knots (n+1,), to the fastest drive; `curvature` at the start of each cell (n,)."""
    n = len(length)
    for i in range(n):
        square[i] = min(square[i], cap[i])
        square[i + 1] = min(square[i + 1], cap[i])
    for i in range(n - 1, -1, -1):
        end = curvature[i] + sharpness[i] * length[i]
        most = gain(square[i + 1], end, -sharpness[i], length[i], limits)
        square[i] = min(square[i], square[i + 1] + 2.0 * most * length[i])
    for i in range(n):
        most = gain(square[i], curvature[i], sharpness[i], length[i], limits)
        square[i + 1] = min(square[i + 1], square[i] + 2.0 * most * length[i])


@kernel
def peak(
    length: float, curvature: float, sharpness: float, cap: float, limits: Caps, first: float, last: float
) -> tuple[float, float]:
    """Within a line or arc u may rise above both ends: the largest u reached, and the acceleration to get there."""
    if sharpness != 0.0:
        return max(first, last), 0.0
    most = gain(first, curvature, 0.0, length, limits)
    return max(min(cap, 0.5 * (first + last) + most * length), first, last), most


@kernel
def cell_time(length: float, first: float, last: float, top: float, most: float) -> float:
    """Seconds for a cell: up to `top`, on at `top`, down; or straight from `first` to `last` (u)."""
    start, end = math.sqrt(first), math.sqrt(last)
    if most <= 0.0 or (top == first and top == last):
        return 2.0 * length / max(start + end, 1e-12)
    fast = math.sqrt(top)
    cruise = max(length - (top - first) / (2.0 * most) - (top - last) / (2.0 * most), 0.0)
    return (fast - start) / most + (fast - end) / most + cruise / max(fast, 1e-12)


@kernel
def _parts(piece: Floats) -> int:
    """Cells of a piece: one, or for a clothoid two at least (between two stops the robot has to move)."""
    return 1 if piece[2] == 0.0 else max(2, math.ceil(abs(piece[2]) * piece[0] / CELL_CURVATURE_1PM))


@kernel
def path_time(pieces: Floats, count: int, first: float, last: float, limits: Caps) -> float:
    """Seconds for `count` pieces (as columns of `Piece`), entered and left at speeds (m/s), standing still at cusps.

    For comparing transitions: a speed at an end that the transition does not allow is lowered, and punished, as it
    would slow down the painted line there.
    """
    cells = 0
    for k in range(count):
        cells += _parts(pieces[k]) if pieces[k, 0] > 0.0 else 0
    length, curvature, sharpness = np.empty(cells), np.empty(cells), np.empty(cells)
    cap = np.empty(cells)
    square = np.full(cells + 1, np.inf)
    square[0], square[cells] = first * first, last * last
    seconds, i, direction = 0.0, 0, 0.0
    for k in range(count):
        if pieces[k, 4] != 0.0:
            seconds += spin_time(abs(pieces[k, 4]), limits)
            square[i] = 0.0
        if pieces[k, 0] <= 0.0:
            continue
        if direction * pieces[k, 3] < 0.0:
            square[i] = 0.0
        direction = pieces[k, 3]
        parts = _parts(pieces[k])
        h = pieces[k, 0] / parts
        for j in range(parts):
            length[i], sharpness[i] = h, pieces[k, 2]
            curvature[i] = pieces[k, 1] + pieces[k, 2] * h * j
            worst = max(abs(curvature[i]), abs(curvature[i] + sharpness[i] * h))
            cap[i] = square_cap(worst, abs(sharpness[i]), limits)
            i += 1
    sweep(length, curvature, sharpness, cap, limits, square)
    for i in range(cells):
        top, most = peak(length[i], curvature[i], sharpness[i], cap[i], limits, square[i], square[i + 1])
        seconds += cell_time(length[i], square[i], square[i + 1], top, most)
    lost = max(first - math.sqrt(square[0]), 0.0) + max(last - math.sqrt(square[cells]), 0.0)
    return seconds + (SLOWED_S_PER_MPS * lost if lost > SPEED_SLACK_MPS else 0.0)


@kernel
def entries(
    length: Floats, curvature: Floats, sharpness: Floats, cap: Floats, limits: Caps, square: Floats
) -> tuple[Floats, Floats]:
    """The swept profile as (arc length, u) of every point where u may bend."""
    n = len(length)
    station, value = np.empty(3 * n + 1), np.empty(3 * n + 1)
    at = 0.0
    station[0], value[0] = 0.0, square[0]
    k = 1
    for i in range(n):
        first, last = square[i], square[i + 1]
        top, most = peak(length[i], curvature[i], sharpness[i], cap[i], limits, first, last)
        if most > 0.0 and top > max(first, last):
            station[k], value[k] = at + (top - first) / (2.0 * most), top
            station[k + 1], value[k + 1] = at + length[i] - (top - last) / (2.0 * most), top
            k += 2
        elif most > 0.0 and top > min(first, last):
            rise, fall = (top - first) / (2.0 * most), (top - last) / (2.0 * most)
            station[k], value[k] = at + (rise if rise > 0.0 else length[i] - fall), top
            k += 1
        at += length[i]
        station[k], value[k] = at, last
        k += 1
    return station[:k], value[:k]
