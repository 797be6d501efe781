"""Compiled: time-optimal path parametrisation (TOPP), the fastest speeds along cells of constant sharpness.

State is u = v² (m²/s²), linear in arc length within a cell (constant acceleration). The limits are those of
drives/caps.py. A backward pass finds the fastest entries from which the rest can be driven, a forward pass the fastest
drive through them: the optimum on these cells, after Pham and Pham, "A new approach to time-optimal path
parameterization based on reachability analysis", IEEE T-RO 34(3), 2018.
"""

import math

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.drives.caps import Caps, gain, spin_time, square_cap
from touchline.services.planner.geometry.clothoid import Floats

# A cell of a clothoid changes curvature by at most this (1/m): its speed is capped for the tighter end.
CELL_CURVATURE_1PM = 0.15
# Price of slowing down a painted line next to a transition, and the tolerance.
SLOWED_S_PER_MPS, SPEED_SLACK_MPS = 30.0, 1e-6


@kernel
def sweep(length: Floats, curvature: Floats, sharpness: Floats, cap: Floats, limits: Caps, square: Floats) -> None:
    """Lower the squared speeds at the knots to those of the fastest drive.

    The backward pass finds the maximum entry of each cell from which the rest can be driven, the forward pass follows
    (Pham and Pham 2018). A given speed, such as a standstill, is an upper bound at its knot.

    Args:
        length: (n,) lengths of the cells (m), positive.
        curvature: (n,) signed curvature at the beginning of each cell (1/m).
        sharpness: (n,) signed sharpness, constant over each cell (1/m²).
        cap: (n,) maximum u of each cell (m²/s²), from `square_cap`.
        limits: Limits of drive and plan.
        square: (n + 1,) u at the knots (m²/s²): upper bounds, lowered in place.
    """
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
    length: float, curvature: float, sharpness: float, cap: float, limits: Caps, ends: tuple[float, float]
) -> tuple[float, float]:
    """Maximum speed within a cell: on a line or arc the robot may speed up and brake again.

    Args:
        length: Length of the cell (m).
        curvature: Signed curvature at its beginning (1/m).
        sharpness: Signed sharpness, constant (1/m²); on a clothoid u is linear between the ends.
        cap: Maximum u of the cell (m²/s²).
        limits: Limits of drive and plan.
        ends: u at its beginning and at its end (m²/s²).

    Returns:
        Maximum u reached (m²/s²), and the acceleration (m/s²) up to it and down again: 0 on a clothoid.
    """
    first, last = ends
    if sharpness != 0.0:
        return max(first, last), 0.0
    most = gain(first, curvature, 0.0, length, limits)
    return max(min(cap, 0.5 * (first + last) + most * length), first, last), most


@kernel
def cell_time(length: float, first: float, last: float, top: float, most: float) -> float:
    """Seconds for a cell: accelerating, at maximum speed, and braking; or with constant acceleration throughout.

    Args:
        length: Length of the cell (m).
        first: u = v² at its beginning (m²/s²).
        last: u at its end.
        top: Maximum u in it, from `peak`.
        most: Acceleration (m/s²) up to it and down again; 0: u is linear between the ends.
    """
    start, end = math.sqrt(first), math.sqrt(last)
    if most <= 0.0 or (top == first and top == last):
        return 2.0 * length / max(start + end, 1e-12)
    fast = math.sqrt(top)
    cruise = max(length - (top - first) / (2.0 * most) - (top - last) / (2.0 * most), 0.0)
    return (fast - start) / most + (fast - end) / most + cruise / max(fast, 1e-12)


@kernel
def _parts(piece: Floats) -> int:
    """Number of cells of a piece: one, or for a clothoid at least two (the robot has to move between two stops)."""
    return 1 if piece[2] == 0.0 else max(2, math.ceil(abs(piece[2]) * piece[0] / CELL_CURVATURE_1PM))


@kernel
def path_time(pieces: Floats, count: int, first: float, last: float, limits: Caps) -> float:
    """Seconds for the fastest drive along pieces, with a standstill at every cusp and turn on the spot.

    It compares transitions: a speed at an end that the transition does not allow is lowered at the price of
    SLOWED_S_PER_MPS, as that slows down the painted line there.

    Args:
        pieces: (at least `count`, 5) columns of `Piece` (m, 1/m, 1/m², direction, rad).
        count: Number of pieces.
        first: Speed at which they are entered (m/s).
        last: Speed at which they are left (m/s).
        limits: Limits of drive and plan.
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
        top, most = peak(length[i], curvature[i], sharpness[i], cap[i], limits, (square[i], square[i + 1]))
        seconds += cell_time(length[i], square[i], square[i + 1], top, most)
    lost = max(first - math.sqrt(square[0]), 0.0) + max(last - math.sqrt(square[cells]), 0.0)
    return seconds + (SLOWED_S_PER_MPS * lost if lost > SPEED_SLACK_MPS else 0.0)


@kernel
def entries(
    length: Floats, curvature: Floats, sharpness: Floats, cap: Floats, limits: Caps, square: Floats
) -> tuple[Floats, Floats]:
    """Points of the swept profile between which u = v² is linear in arc length.

    Args:
        length: (n,) of the cells (m).
        curvature: (n,) signed curvature at the beginning of each cell (1/m).
        sharpness: (n,) signed sharpness, constant over each cell (1/m²).
        cap: (n,) maximum u of each cell (m²/s²).
        limits: Limits of drive and plan.
        square: (n + 1,) u at the knots (m²/s²), from `sweep`.

    Returns:
        (m,) arc lengths (m) and (m,) u there (m²/s²): the knots, and the points where acceleration ends or braking
        begins within cells.
    """
    n = len(length)
    station, value = np.empty(3 * n + 1), np.empty(3 * n + 1)
    at = 0.0
    station[0], value[0] = 0.0, square[0]
    k = 1
    for i in range(n):
        first, last = square[i], square[i + 1]
        top, most = peak(length[i], curvature[i], sharpness[i], cap[i], limits, (first, last))
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
