"""Heavy-tailed errors of positions: outlying fixes get less weight instead of being rejected.

An honest receiver's errors have a tail: most fixes are within millimetres, every fiftieth is centimetres off. With a
variance that covers all of them as normally distributed, a gate would reject every thirtieth fix, and now and then
several in a row, for which the robot would stop. The white error is therefore taken to have a Student-t distribution:
normal with the variance r/λ, where λ is different for each fix and gamma distributed, and r the square of its scale.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.estimation.updates import spread

Floats = NDArray[np.float64]

OUTLYING: Final = 0.05
"""Share of honest fixes that err more than a fix that is not outlying."""
BURST_SHARE: Final = 0.091
"""Share of the time in bursts of errors, of a receiver that has them while its antenna moves."""
_LEAST_LIKELY = 1e-4
_IMPOSSIBLE = 1e-300
CONTRADICTED: Final = 27.6
"""Limit of −ln of the likelihood, 1e-12, at which a run of outlying fixes is no chance. Three fixes that are 8 cm or
more off are as unlikely, or five that are 3 cm off. Of 40 million honest fixes, drawn as the emulator does, none ends
such a run."""
_ROUNDS = 8


@kernel
def weighed_variance(P: Floats, h: Floats, y: tuple[float, float], variance: float, dof: float) -> float:
    """Return the variance r/λ with which to use a fix [m²], the same for both axes.

    λ = (ν + 2) / (ν + (ȳᵀȳ + tr H P⁺ Hᵀ) / r), with the residual ȳ and the covariance P⁺ after the update with r/λ, by
    fixed-point iteration: the variational solution of Agamennoni, Nieto and Nebot ("Approximate inference in
    state-space models with heavy-tailed noise", IEEE Trans. Signal Processing 60(10), 2012) and of Piché, Särkkä and
    Hartikainen ("Recursive outlier-robust filtering and smoothing for nonlinear systems using the multivariate
    Student-t distribution", MLSP 2012). The best fixes count (ν + 2)/ν times as one with r, one that is y off, far
    beyond √r, about (ν + 2) r / y² times. Where the state is as uncertain as the fix is far off, as after an outage,
    the fix has its full weight.

    Args:
        P: (STATES, STATES) covariance before the update; it has the slow error, which is not weighed down.
        h: (2, STATES) rows of the fix.
        y: Innovations to the east and to the north [m].
        variance: Variance of the white error along an axis, its tail included [m²]; that of a t is ν/(ν − 2) times r.
        dof: ν, the degrees of freedom of the error's distribution, more than 2.
    """
    y0, y1 = y
    s00, s01, s11 = spread(P, h)
    r = variance * (dof - 2.0) / dof
    weighed = r
    for _ in range(_ROUNDS):
        a, d = s00 + weighed, s11 + weighed
        determinant = a * d - s01 * s01
        e0, e1 = weighed * (d * y0 - s01 * y1) / determinant, weighed * (a * y1 - s01 * y0) / determinant
        left = weighed * (2.0 - weighed * (a + d) / determinant)  # tr H P⁺ Hᵀ
        weighed = r * (dof + (e0 * e0 + e1 * e1 + left) / r) / (dof + 2.0)
    return weighed


@kernel
def bounded(nis: float, dof: float) -> float:
    """Bound a normalised innovation squared (NIS) as the fix's weight bounds its effect: mean 2 still, at most ν + 2.

    The result is (ν + 2) / (ν + m) · m with m = NIS · ν/(ν − 2), the squared innovation against the scale of a
    bivariate t.

    Args:
        nis: NIS of both axes.
        dof: ν.
    """
    return (dof + 2.0) * nis / (dof - 2.0 + nis)


@kernel
def likelihood(nis: float, dof: float) -> float:
    """Return the share of an honest receiver's fixes that err at least as much: (1 + m/ν)^(−ν/2) of a bivariate t.

    Args:
        nis: NIS of both axes; m is that of `bounded`.
        dof: ν.
    """
    share: float = (1.0 + nis / (dof - 2.0)) ** (-0.5 * dof)
    return share


@kernel
def likelihood_in_burst(nis: float) -> float:
    """Return the share of fixes that err at least as much because of a burst: that of bursts, times exp(−NIS/2).

    Args:
        nis: NIS of both axes, with the variance of a burst's errors.
    """
    share: float = BURST_SHARE * math.exp(-0.5 * nis)
    return share


@kernel
def likelihood_of_one(nis: float) -> float:
    """Return the share of normally distributed numbers that err at least as much: erfc √(NIS/2)."""
    share: float = math.erfc(math.sqrt(0.5 * nis))
    return share


@kernel
def doubt(so_far: float, share: float, news: float) -> float:
    """Return −ln of the likelihood of a run of outlying fixes to which a fix is added.

    That likelihood is the product of those of its fixes, of which none counts as less likely than 1 in 10,000: one wild
    fix alone contradicts nothing. A fix that is not outlying ends the run. Errors that are correlated by ϕ repeat
    themselves: where e makes the first fix less likely by e²/2σ², it makes the next one so by (1 − ϕ)/(1 + ϕ) of that.

    Args:
        so_far: −ln of the likelihood of the run before; 0 if there is none.
        share: Share of an honest receiver's fixes that err at least as much as the new one (`likelihood`).
        news: (1 − ϕ)/(1 + ϕ) of the receiver; 1 if its errors are independent.
    """
    if share > OUTLYING:
        return 0.0
    told = -math.log(max(share, _IMPOSSIBLE))
    if so_far > 0.0:
        told *= news
    return so_far + min(told, -math.log(_LEAST_LIKELY))
