"""Scalar and paired measurement updates that keep P symmetric to the bit.

Numbers that are measured at once are processed one after the other, which takes no inverse (sequential Kalman
filtering: D. Simon, Optimal State Estimation, Wiley 2006, section 6.1).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.estimation.tick_estimate import Scratch
from touchline.onboard.filter_model import GATE_1_DOF, STATES, UPDATE_VALUE, UPDATE_VARIANCE, VARYING

Floats = NDArray[np.float64]


@borrowing
def apply(x: Floats, P: Floats, h: Floats, innovation: float, variance: float, g: Floats, taught: int) -> float:
    """Update with one number: with S = h P hᵀ + r, x ← x + P hᵀ y/S and P ← P − (P hᵀ)(P hᵀ)ᵀ/S.

    States behind those that are taught are considered: they and their covariance stay, and the others know how wrong
    they may be (S. F. Schmidt, "Application of State-Space Methods to Navigation Problems", Advances in Control Systems
    3, 1966).

    Args:
        x: (STATES,) state, updated.
        P: (STATES, STATES) its covariance, updated.
        h: (STATES,) row of the measurement, mostly zeros.
        innovation: y, measured less expected.
        variance: r, variance of the measurement.
        g: (STATES,) set to P hᵀ/√S.
        taught: Number of states that are taught: `STATES` or `VARYING`.

    Returns:
        y/√S: states that are taught have changed by g times that.
    """
    s = variance
    for i in range(STATES):
        g[i] = 0.0
    for k in range(STATES):
        if h[k] != 0.0:
            for i in range(STATES):
                g[i] += P[k, i] * h[k]  # P is symmetric to the bit: its rows lie together in memory
    for i in range(STATES):
        s += h[i] * g[i]
    root = 1.0 / math.sqrt(s)
    for i in range(STATES):
        g[i] *= root
    whitened = innovation * root
    for i in range(taught):
        x[i] += g[i] * whitened
    # Rows of a length that the compiler knows; g[i]·g[k] is symmetric to the bit, (g[i]/S)·g[k] is not.
    for i in range(VARYING):
        for k in range(STATES):
            P[i, k] -= g[i] * g[k]
    for i in range(VARYING, STATES):
        for k in range(taught):
            P[i, k] -= g[i] * g[k]
    return whitened


@borrowing
def spread(P: Floats, h: Floats) -> tuple[float, float, float]:
    """Return the part H P Hᵀ of the covariance of two measured numbers that comes from the state.

    Args:
        P: (STATES, STATES) covariance of the state.
        h: (2, STATES) rows of the measurement.

    Returns:
        The variance of the first number, the covariance of both, and the variance of the second.
    """
    s00, s01, s11 = 0.0, 0.0, 0.0
    for i in range(STATES):
        if h[0, i] != 0.0 or h[1, i] != 0.0:
            a, b = 0.0, 0.0
            for k in range(STATES):
                a += P[i, k] * h[0, k]
                b += P[i, k] * h[1, k]
            s00 += h[0, i] * a
            s01 += h[0, i] * b
            s11 += h[1, i] * b
    return s00, s01, s11


@borrowing
def nis_of_two(P: Floats, h: Floats, y: tuple[float, float], r: float) -> float:
    """Return the normalised innovation squared (NIS) of two numbers measured at once: yᵀ (H P Hᵀ + r I)⁻¹ y.

    Args:
        P: (STATES, STATES) covariance of the state.
        h: (2, STATES) rows of the measurement.
        y: Innovations of the first and the second.
        r: Variance of each.
    """
    y0, y1 = y
    s00, s01, s11 = spread(P, h)
    s00, s11 = s00 + r, s11 + r
    nis: float = (s11 * y0 * y0 - 2.0 * s01 * y0 * y1 + s00 * y1 * y1) / (s00 * s11 - s01 * s01)
    return nis


@borrowing
def whitened(P: Floats, h: Floats, y: tuple[float, float], r: float) -> tuple[float, float, float]:
    """Return innovations of two numbers measured at once as independent ones with variance 1, and ln det S.

    They are L⁻¹ y with L Lᵀ = S = H P Hᵀ + r I.

    Args:
        P: (STATES, STATES) covariance of the state.
        h: (2, STATES) rows of the measurement.
        y: Innovations of the first and the second.
        r: Variance of each.
    """
    s00, s01, s11 = spread(P, h)
    s00, s11 = s00 + r, s11 + r
    rest = s11 - s01 * s01 / s00
    return y[0] / math.sqrt(s00), (y[1] - s01 / s00 * y[0]) / math.sqrt(rest), math.log(s00 * rest)


@kernel
def apply_two(
    x: Floats, P: Floats, scratch: Scratch, y: tuple[float, float], r: float, taught: int, considered: int
) -> None:
    """Update with two numbers that are measured at once, one by one: the first update corrects the second innovation.

    Args:
        x: (STATES,) state, updated.
        P: (STATES, STATES) its covariance, updated.
        scratch: Rows of the measurement, and memory that is overwritten.
        y: Innovations of the first and the second.
        r: Variance of each.
        taught: Number of states that are taught, as in `apply`.
        considered: One of these that is considered instead; `STATES`: none.
    """
    h, g = scratch
    y0, y1 = y
    value, variance = 0.0, 0.0
    if considered < taught:
        value, variance = x[considered], P[considered, considered]
    moved = apply(x, P, h[0], y0, r, g, taught)
    for i in range(taught):
        if i != considered:
            y1 -= h[1, i] * g[i] * moved
    if considered < taught:
        P[considered, considered] = variance
    apply(x, P, h[1], y1, r, g, taught)
    if considered < taught:
        x[considered], P[considered, considered] = value, variance


@kernel
def passes_gate(x: Floats, P: Floats, row: Floats) -> bool:
    """Return whether a scalar measurement lies within its gate: y² ≤ χ² · (h P hᵀ + r).

    Args:
        x: (STATES,) state.
        P: (STATES, STATES) its covariance.
        row: (UPDATE_COLUMNS,) Jacobian, value and variance.
    """
    innovation, s = row[UPDATE_VALUE], row[UPDATE_VARIANCE]
    for i in range(STATES):
        innovation -= row[i] * x[i]
        for k in range(STATES):
            s += row[i] * P[i, k] * row[k]
    inside: bool = innovation * innovation <= GATE_1_DOF * s
    return inside


@kernel
def apply_rows(x: Floats, P: Floats, rows: Floats, count: int, g: Floats) -> None:
    """Update with scalar measurements z = h x + v, one by one.

    Args:
        x: (STATES,) state, updated.
        P: (STATES, STATES) its covariance, updated.
        rows: (n, UPDATE_COLUMNS) Jacobian h, value z and variance of v of each.
        count: Number of rows that are used.
        g: (STATES,) overwritten.
    """
    for index in range(count):
        row = rows[index]
        innovation = row[UPDATE_VALUE]
        for i in range(STATES):
            innovation -= row[i] * x[i]
        apply(x, P, row[:STATES], innovation, row[UPDATE_VARIANCE], g, VARYING)
