"""Bursts of a receiver's errors: the filter keeps a place for a receiver in a burst, and one for a receiver in none.

While its antenna moves, a receiver errs by a centimetre and more for seconds, and by a millimetre or two otherwise. In
which of these modes it is follows a two-state Markov chain, whose probability is estimated with the state. A fix is
used as one in a burst, as one of a receiver that still is in none, and as one whose burst has ended; what they say is
merged by mode (generalised pseudo-Bayesian estimator of second order: Y. Bar-Shalom, X. R. Li and T. Kirubarajan,
Estimation with Applications to Tracking and Navigation, Wiley 2001, section 11.6.5). The modes share all states but
the place: of each is kept by how much place and variance differ from those of the merged estimate. One estimate for
both would take its own wrong place for right, and each fix for one in a burst: with as much as it does not know of the
place, a fix without a burst would be no likelier where the last one was than a centimetre away.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.estimation.tail import BURST_SHARE, weighed_variance
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply_two, spread
from touchline.onboard.filter_model import (
    EAST,
    GNSS_EAST,
    GNSS_NORTH,
    NORTH,
    STATES,
    FilterFigures,
    FixInTick,
    TickInputs,
)

Floats = NDArray[np.float64]

_CALM: Final = 0  # rows of `TickInputs.places`
_BURST: Final = 1
_LEAST_SHARE = 0.02  # of the merged variance of the place, that of a mode


@kernel
def carry_modes(before: TickInputs, z: TickInputs, c: FilterFigures) -> None:
    """Carry the modes of the receiver from the tick before to the next one.

    Args:
        before: Inputs of the tick before.
        z: Inputs of the tick, updated.
        c: Figures of the filter.
    """
    z.burst = before.burst
    z.switching = before.switching + c.burst_change * (1.0 - before.switching)
    for mode in range(2):
        for k in range(3):
            z.places[mode, k] = before.places[mode, k]


@kernel
def correlated_error(z: TickInputs, c: FilterFigures) -> tuple[float, float]:
    """Return share per tick and variance [m²] of the correlated error of fixes, with which to predict a tick.

    Args:
        z: Inputs of the tick.
        c: Figures of the filter.
    """
    if c.burst_var == 0.0:
        return c.gnss_decay, c.gnss_var
    return c.burst_decay, (z.burst + z.switching * (BURST_SHARE - z.burst)) * c.burst_var


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
def update_by_mode(
    at: TickEstimate, fix: FixInTick, y: tuple[float, float], c: FilterFigures, scratch: Scratch
) -> float:
    """Update with a fix as one in a burst and as one without, and merge both.

    Args:
        at: Tick, whose state, covariance and modes are updated.
        fix: The fix.
        y: Its innovations.
        c: Figures of the filter.
        scratch: Its rows are those of the fix; overwritten.

    Returns:
        Variance with which the fix was weighed [m²] as one without a burst.
    """
    x, P, z = at
    h, g, others = scratch
    calm, Q, ended, R = others[0, 0], others[0, 1:], others[1, 0], others[1, 1:]
    ends, begins = z.switching * (1.0 - BURST_SHARE), z.switching * BURST_SHARE
    lasting, begun = z.burst * (1.0 - ends), (1.0 - z.burst) * begins
    chance = lasting + begun
    y_calm = without_burst(x, h, y)
    _copy_calm(x, P, calm, Q)
    _copy_calm(x, P, ended, R)
    weighed, fit = _update_at(calm, Q, z.places[_CALM], h, y_calm, fix, c, g)
    stayed = (1.0 - z.burst) * (1.0 - begins) * fit
    _, fit = _update_at(ended, R, z.places[_BURST], h, y_calm, fix, c, g)
    left = z.burst * ends * fit

    h[0, GNSS_EAST], h[1, GNSS_NORTH] = 1.0, 1.0
    # A burst that has just begun has nothing of what is known of the error.
    P[GNSS_EAST, GNSS_EAST] += (1.0 - chance) * c.burst_var
    P[GNSS_NORTH, GNSS_NORTH] += (1.0 - chance) * c.burst_var
    _mix_places(z.places, lasting / chance)
    _, fit = _update_at(x, P, z.places[_BURST], h, y, fix, c, g)
    bursting = chance * fit

    _merge(calm, Q, ended, R, stayed / (stayed + left), g)
    z.burst, z.switching = bursting / (bursting + stayed + left), 0.0
    _note_place(z.places[_CALM], calm, Q, 1.0)
    _note_place(z.places[_BURST], x, P, 1.0)
    _merge(x, P, calm, Q, z.burst, g)
    _note_place(z.places[_CALM], x, P, -1.0)
    _note_place(z.places[_BURST], x, P, -1.0)
    return weighed


@borrowing
def _copy_calm(x: Floats, P: Floats, calm: Floats, Q: Floats) -> None:
    """Copy state and covariance without the error of a burst."""
    for i in range(STATES):
        calm[i] = x[i]
        for k in range(STATES):
            Q[i, k] = P[i, k]
    for i in (GNSS_EAST, GNSS_NORTH):
        calm[i] = 0.0
        for k in range(STATES):
            Q[i, k] = Q[k, i] = 0.0


@borrowing
def _mix_places(places: Floats, lasting: float) -> None:
    """Mix into the place in a burst, in which the receiver was by a share of the chances, that of one which begins."""
    begun, square = 1.0 - lasting, 0.0
    for k in range(2):
        apart = places[_CALM, k] - places[_BURST, k]
        square += apart * apart
        places[_BURST, k] += begun * apart
    variance = lasting * places[_BURST, 2] + begun * places[_CALM, 2]
    places[_BURST, 2] = variance + 0.5 * lasting * begun * square


@borrowing
def _update_at(
    x: Floats, P: Floats, place: Floats, h: Floats, y: tuple[float, float], fix: FixInTick, c: FilterFigures, g: Floats
) -> tuple[float, float]:
    """Update state and covariance from the place of a mode, and return the weighed variance and the fix's density."""
    middle = 0.5 * (P[EAST, EAST] + P[NORTH, NORTH])
    scale = math.sqrt(max(1.0 + place[2] / middle, _LEAST_SHARE))
    x[EAST] += place[0]
    x[NORTH] += place[1]
    for i in (EAST, NORTH):
        for k in range(STATES):
            P[i, k] *= scale
        for k in range(STATES):
            P[k, i] *= scale
    y = (y[0] - place[0], y[1] - place[1])
    fit = _density(P, h, y, fix.variance_m2, c.fix_dof)
    weighed = weighed_variance(P, h, y, fix.variance_m2, c.fix_dof)
    apply_two(x, P, h, y, weighed, g, STATES)
    return weighed, fit


@borrowing
def _merge(x: Floats, P: Floats, other: Floats, Q: Floats, share: float, g: Floats) -> None:
    """Merge the other estimate into the first one, which is right by a share of the chances, by their moments."""
    rest = 1.0 - share
    for i in range(STATES):
        g[i] = x[i] - other[i]
    for i in range(STATES):
        x[i] -= rest * g[i]
        for k in range(STATES):
            P[i, k] = share * P[i, k] + rest * Q[i, k] + share * rest * (g[i] * g[k])


@borrowing
def _note_place(place: Floats, x: Floats, P: Floats, sign: float) -> None:
    """Set the place of a mode to that of an estimate, or subtract that of the merged one."""
    kept = 0.0 if sign > 0.0 else 1.0
    place[0] = kept * place[0] + sign * x[EAST]
    place[1] = kept * place[1] + sign * x[NORTH]
    place[2] = kept * place[2] + sign * 0.5 * (P[EAST, EAST] + P[NORTH, NORTH])


@borrowing
def _density(P: Floats, h: Floats, y: tuple[float, float], r: float, dof: float) -> float:
    """Return the density of innovations, but for a factor: that of a bivariate t with `dof` degrees of freedom."""
    s00, s01, s11 = spread(P, h)
    s00, s11 = s00 + r, s11 + r
    determinant = s00 * s11 - s01 * s01
    nis = (s11 * y[0] * y[0] - 2.0 * s01 * y[0] * y[1] + s00 * y[1] * y[1]) / determinant
    density: float = (1.0 + nis / (dof - 2.0)) ** (-0.5 * dof - 1.0) / math.sqrt(determinant)
    return density
