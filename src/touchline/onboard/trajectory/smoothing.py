"""Smoothing: removes the steps of the path's curvature where nothing is painted.

A plan's clothoids arrive cut into arcs. Fed forward, each arc's step of curvature would reach the wheels. Where the
robot does not paint, the followed path may therefore deviate slightly: with u its dκ/ds and e its distance from the
path, ∫ e²/ε² + u²/σ₀² ds is minimised, a linear-quadratic problem with the state (e, e′, κ), solved by a Riccati
recursion (D. P. Bertsekas, Dynamic Programming and Optimal Control, volume I, 3rd edition, Athena Scientific 2005,
section 4.1) over pieces on which u is constant. Arcs become the clothoid that they were cut from, or one as near.
Painted rows, the middle of long rows, and places where a path really steps in curvature are followed as they are, and
joined with their curvature.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.trajectory.path import SPIN, Leg, poses_along

W_CURVATURE: Final = 3
W_LENGTH: Final = 4
W_START: Final = 5  # arc length of the path
W_SHARPNESS: Final = 6
W_SEGMENT: Final = 7
COLUMNS: Final = 8

MAX_OFFSET_M = 1.5e-3
"""Largest distance from the path: plans are cut to within 1 mm of the intended curve."""
PIECE_M = 0.1
REACH_M = 0.6
"""Length at each end of a longer unpainted segment over which it may be smoothed."""
OFFSET_SCALE_M = 1e-3
WIDTHS_M = (0.20, 0.15, 0.11, 0.08, 0.06, 0.04)
"""Lengths over which curvature is evened out, (ε/σ₀)^⅓: the largest that stays within MAX_OFFSET_M is taken."""
_END_WEIGHT = (1e13, 1e11, 1e9)  # of e, e′ and κ where the smoothed path returns to the path
_END_TOLERANCE_M = 1e-5

Floats = NDArray[np.float64]


class Stretch(NamedTuple):
    """Consecutive pieces that may leave the path.

    Attributes:
        first, last: Pieces first … last − 1.
        before, after: Curvature of the adjoining pieces, 1/m.
    """

    first: int
    last: int
    before: float
    after: float


def smooth_leg(path: Floats, leg: Leg, painted: NDArray[np.bool_]) -> Floats:
    """Make the pieces of a leg that the robot follows: its path, smoothed where nothing is painted.

    Args:
        path: (n, 7) rows of `path.cut_path`.
        leg: Leg to smooth.
        painted: (n,) True for rows that are followed as they are.

    Returns:
        (m, COLUMNS) x, y, heading of the robot, curvature and its rate dκ/ds at the start, each with the arc length of
            the path at which it starts, its length and the row that it belongs to.
    """
    pieces, free = _pieces(path, leg, painted)
    if leg.sense != SPIN:
        even_out(pieces, free, _steps(path, pieces), float(leg.sense), np.array(WIDTHS_M), MAX_OFFSET_M)
    return pieces


def _steps(path: Floats, pieces: Floats) -> NDArray[np.bool_]:
    """Find the pieces (m,) that begin with a step of curvature larger than that of any cut clothoid.

    Two arcs of length l stay within Δκ·l²/54 of the clothoid that they were cut from.
    """
    row = pieces[:, W_SEGMENT].astype(np.int64)
    before = np.concatenate((row[:1], row[:-1]))
    shorter = np.minimum(path[row, 4], path[before, 4])
    larger: NDArray[np.bool_] = np.abs(path[row, 3] - path[before, 3]) * shorter**2 > 54.0 * MAX_OFFSET_M
    return larger


def _pieces(path: Floats, leg: Leg, painted: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """Cut the path into pieces, and mark those that may leave it."""
    rows: list[tuple[int, float, float, bool]] = []
    for i in range(leg.first, leg.last):
        length = float(path[i, 4])
        if painted[i]:
            rows.append((i, 0.0, length, False))
            continue
        reach = length if length <= 2.0 * REACH_M + PIECE_M else REACH_M
        count = max(math.ceil(reach / PIECE_M), 2)
        ends = [reach * j / count for j in range(count + 1)]
        rows += [(i, a, b, True) for a, b in pairwise(ends)]
        if reach < length:
            rows.append((i, reach, length - reach, False))
            rows += [(i, length - b, length - a, True) for b, a in zip(ends[::-1], ends[-2::-1], strict=False)]
    pieces = np.zeros((len(rows), COLUMNS))
    index = np.array([row[0] for row in rows])
    start, end = (np.array([row[column] for row in rows]) for column in (1, 2))
    pieces[:, :3] = poses_along(path[index], start)
    pieces[:, W_CURVATURE], pieces[:, W_LENGTH] = path[index, 3], end - start
    pieces[:, W_START], pieces[:, W_SEGMENT] = path[index, 5] + start, index
    return pieces, np.array([row[3] for row in rows])


@kernel
def even_out(
    pieces: Floats, free: NDArray[np.bool_], steps: NDArray[np.bool_], sense: float, widths: Floats, limit: float
) -> None:
    """Smooth the free pieces, stretch by stretch, each with the largest of `widths` that stays within `limit`.

    A stretch with an intended step of curvature is left as it is.

    Args:
        pieces: (m, COLUMNS) of `smooth_leg`, moved.
        free: (m,) True for pieces that may be moved.
        steps: (m,) of `_steps`.
        sense: +1 if the leg is driven forward, −1 if backward.
        widths: Lengths to try, largest first, m.
        limit: Largest distance from the path, m.
    """
    count = pieces.shape[0]
    first = 0
    while first < count:
        last = first
        while last < count and free[last]:
            last += 1
        if last > first and not _any(steps, first, min(last + 1, count)):
            before = pieces[first - 1, W_CURVATURE] if first > 0 else pieces[first, W_CURVATURE]
            after = pieces[last, W_CURVATURE] if last < count else pieces[last - 1, W_CURVATURE]
            stretch = Stretch(first, last, before, after)
            for width in widths:
                state = _optimum(pieces, stretch, sense, width)
                if _greatest(state) <= limit and abs(state[-1, 0]) <= _END_TOLERANCE_M:
                    _move(pieces, stretch, sense, state)
                    break
        first = last + 1


@kernel
def _any(steps: NDArray[np.bool_], first: int, end: int) -> bool:
    """Return True if there is a step at one of the pieces first … end − 1."""
    found = False
    for i in range(first, end):
        found = found or steps[i]
    return found


@kernel
def _greatest(state: Floats) -> float:
    """Return the greatest distance from the path (m)."""
    greatest = 0.0
    for i in range(len(state)):
        greatest = max(greatest, abs(state[i, 0]))
    return greatest


@kernel
def _joint(pieces: Floats, j: int, sense: float) -> tuple[float, float]:
    """Return the gap to the left (m) and the kink (rad) between the end of the piece before piece j and its start."""
    half = 0.5 * pieces[j - 1, W_CURVATURE] * pieces[j - 1, W_LENGTH]
    chord = sense * pieces[j - 1, W_LENGTH] * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    middle = pieces[j - 1, 2] + half
    x = pieces[j, 0] - pieces[j - 1, 0] - chord * math.cos(middle)
    y = pieces[j, 1] - pieces[j - 1, 1] - chord * math.sin(middle)
    heading = pieces[j, 2]
    return sense * (y * math.cos(heading) - x * math.sin(heading)), heading - middle - half


@kernel
def _optimum(pieces: Floats, stretch: Stretch, sense: float, width: float) -> Floats:
    """Compute (n + 1, 3) the least-cost e, e′ and κ at the start of each of a stretch's n pieces, and at its end."""
    first, last, before, after = stretch
    n = last - first
    gain = np.zeros((n, 4))  # u = −(gain · state + gain[3])
    P = np.zeros((3, 3))
    p = np.zeros(3)
    for i in range(3):
        P[i, i] = _END_WEIGHT[i]
    p[2] = -_END_WEIGHT[2] * after
    off = OFFSET_SCALE_M**-2
    rate = (width**3 / OFFSET_SCALE_M) ** 2
    A = np.zeros((3, 3))
    b = np.zeros(3)
    c = np.zeros(3)
    PA = np.zeros((3, 3))
    q = np.zeros(3)
    for j in range(n - 1, -1, -1):
        d = _step(pieces, first + j, sense, A, b, c)
        for i in range(3):
            q[i] = p[i]
            for k in range(3):
                q[i] += P[i, k] * c[k]
                PA[i, k] = P[i, 0] * A[0, k] + P[i, 1] * A[1, k] + P[i, 2] * A[2, k]
        scale = rate * d
        for i in range(3):
            for k in range(3):
                scale += b[i] * P[i, k] * b[k]
        for k in range(3):
            gain[j, k] = (b[0] * PA[0, k] + b[1] * PA[1, k] + b[2] * PA[2, k]) / scale
        gain[j, 3] = (b[0] * q[0] + b[1] * q[1] + b[2] * q[2]) / scale
        for i in range(3):
            p[i] = A[0, i] * q[0] + A[1, i] * q[1] + A[2, i] * q[2] - scale * gain[j, i] * gain[j, 3]
            for k in range(3):
                P[i, k] = A[0, i] * PA[0, k] + A[1, i] * PA[1, k] + A[2, i] * PA[2, k]
                P[i, k] -= scale * gain[j, i] * gain[j, k]
        P[0, 0] += off * d
    state = np.zeros((n + 1, 3))
    if first > 0:
        aside, turned = _joint(pieces, first, sense)
        state[0, 0], state[0, 1] = -aside, -turned
    state[0, 2] = before
    for j in range(n):
        _step(pieces, first + j, sense, A, b, c)
        u = -gain[j, 3]
        for k in range(3):
            u -= gain[j, k] * state[j, k]
        for i in range(3):
            state[j + 1, i] = A[i, 0] * state[j, 0] + A[i, 1] * state[j, 1] + A[i, 2] * state[j, 2] + b[i] * u + c[i]
    return state


@kernel
def _step(pieces: Floats, j: int, sense: float, A: Floats, b: Floats, c: Floats) -> float:
    """Fill in state′ = A·state + b·u + c over piece j and the joint after it; return the length."""
    d: float = pieces[j, W_LENGTH]
    kappa = pieces[j, W_CURVATURE]
    A[0, 0] = A[1, 1] = A[2, 2] = 1.0
    A[0, 1], A[0, 2], A[1, 2] = d, 0.5 * d * d, d
    b[0], b[1], b[2] = d * d * d / 6.0, 0.5 * d * d, d
    c[0], c[1] = -kappa * 0.5 * d * d, -kappa * d
    if j + 1 < pieces.shape[0]:
        aside, turned = _joint(pieces, j + 1, sense)
        c[0] -= aside
        c[1] -= turned
    return d


@kernel
def _move(pieces: Floats, stretch: Stretch, sense: float, state: Floats) -> None:
    """Move the pieces of a stretch to the result of `_optimum`."""
    first, last = stretch.first, stretch.last
    for j in range(last - first):
        piece = pieces[first + j]
        e, turned, kappa = state[j]
        piece[0] -= sense * e * math.sin(piece[2])
        piece[1] += sense * e * math.cos(piece[2])
        piece[2] += turned
        piece[W_CURVATURE] = kappa
        piece[W_SHARPNESS] = (state[j + 1, 2] - kappa) / piece[W_LENGTH]
