"""Bursts of a receiver's errors: a fix is used both as one in a burst and as one without, by the probability of each.

While its antenna moves, a receiver errs by a centimetre and more for seconds, and by a millimetre or two otherwise. In
which of these modes it is follows a two-state Markov chain, whose probability is estimated with the state: both modes
are updated with a fix, and merged by their likelihoods (generalised pseudo-Bayesian estimator of first order: Y.
Bar-Shalom, X. R. Li and T. Kirubarajan, Estimation with Applications to Tracking and Navigation, Wiley 2001, section
11.6.4). One normal error with the variance of both modes would be too large most of the time, and so small in a burst
that the estimate follows it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.estimation.tail import BURST_SHARE, weighed_variance
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply_two, spread
from touchline.onboard.filter_model import (
    GNSS_EAST,
    GNSS_NORTH,
    STATES,
    FilterFigures,
    FixInTick,
    TickInputs,
)

Floats = NDArray[np.float64]


@kernel
def carry_burst(before: TickInputs, z: TickInputs, c: FilterFigures) -> None:
    """Carry the probability of a burst from the tick before to the next one.

    Args:
        before: Inputs of the tick before.
        z: Inputs of the tick, updated.
        c: Figures of the filter.
    """
    z.burst = before.burst + c.burst_change * (BURST_SHARE - before.burst)


@kernel
def correlated_error(z: TickInputs, c: FilterFigures) -> tuple[float, float]:
    """Return share per tick and variance [m²] of the correlated error of fixes, with which to predict a tick.

    Args:
        z: Inputs of the tick.
        c: Figures of the filter.
    """
    if c.burst_var == 0.0:
        return c.gnss_decay, c.gnss_var
    return c.burst_decay, z.burst * c.burst_var


@borrowing
def without_burst(x: Floats, h: Floats, y: tuple[float, float]) -> tuple[float, float]:
    """Return the innovations of a fix if it is of no burst.

    Args:
        x: (STATES,) state.
        h: (2, STATES) rows of the fix, changed to those of a fix without a correlated error.
        y: Innovations with that.
    """
    h[0, GNSS_EAST], h[1, GNSS_NORTH] = 0.0, 0.0
    return y[0] + x[GNSS_EAST], y[1] + x[GNSS_NORTH]


@borrowing
def update_in_both_modes(
    at: TickEstimate, fix: FixInTick, y: tuple[float, float], c: FilterFigures, scratch: Scratch
) -> float:
    """Update with a fix as one in a burst and as one without, and merge both.

    Args:
        at: Tick, whose state, covariance and probability of a burst are updated.
        fix: The fix.
        y: Its innovations.
        c: Figures of the filter.
        scratch: Its rows are those of the fix; overwritten.

    Returns:
        Variance with which the fix was weighed [m²] as one without a burst.
    """
    x, P, z = at
    h, g, other = scratch
    calm, Q, chance, r = other[0], other[1:], z.burst, fix.variance_m2
    for i in range(STATES):
        calm[i] = x[i]
        for k in range(STATES):
            Q[i, k] = P[i, k]
    # A burst that has just begun has nothing of what is known of the error.
    P[GNSS_EAST, GNSS_EAST] += (1.0 - chance) * c.burst_var
    P[GNSS_NORTH, GNSS_NORTH] += (1.0 - chance) * c.burst_var
    in_burst = chance * _density(P, h, y, r, c.fix_dof)
    apply_two(x, P, h, y, weighed_variance(P, h, y, r, c.fix_dof), g, STATES)

    y = without_burst(calm, h, y)
    for i in (GNSS_EAST, GNSS_NORTH):
        calm[i] = 0.0
        for k in range(STATES):
            Q[i, k] = Q[k, i] = 0.0
    in_calm = (1.0 - chance) * _density(Q, h, y, r, c.fix_dof)
    weighed: float = weighed_variance(Q, h, y, r, c.fix_dof)
    apply_two(calm, Q, h, y, weighed, g, STATES)

    z.burst = in_burst / (in_burst + in_calm)
    rest = 1.0 - z.burst
    for i in range(STATES):
        g[i] = x[i] - calm[i]
    for i in range(STATES):
        x[i] -= rest * g[i]
        for k in range(STATES):
            P[i, k] = z.burst * P[i, k] + rest * Q[i, k] + z.burst * rest * (g[i] * g[k])
    return weighed


@borrowing
def _density(P: Floats, h: Floats, y: tuple[float, float], r: float, dof: float) -> float:
    """Return the density of innovations, but for a factor: that of a bivariate t with `dof` degrees of freedom."""
    s00, s01, s11 = spread(P, h)
    s00, s11 = s00 + r, s11 + r
    determinant = s00 * s11 - s01 * s01
    nis = (s11 * y[0] * y[0] - 2.0 * s01 * y[0] * y[1] + s00 * y[1] * y[1]) / determinant
    density: float = (1.0 + nis / (dof - 2.0)) ** (-0.5 * dof - 1.0) / math.sqrt(determinant)
    return density
