"""First-order Gauss-Markov terms that stand for several errors of a sensor."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from touchline.core.plain_sum import plain_sum

_BRIDGED_S: Final = 30.0  # outage over which the reported σ has to cover the error
_FAR_APART: Final = 20.0  # ratio of the time constants of two terms that one cannot stand for
_LEAST_M: Final = 1e-4

Term = tuple[float, float]
"""Standard deviation and time constant [s]."""


class PositionError(NamedTuple):
    """Correlated error of positions, as the filter treats it.

    Attributes:
        variance: Variance of the part that is a state.
        tau_s: Time constant of it.
        slow_variance: Variance of a far slower part that is considered, not estimated; 0 if there is none.
        slow_tau_s: Time constant of that.
    """

    variance: float
    tau_s: float
    slow_variance: float = 0.0
    slow_tau_s: float = math.inf


def position_error(terms: tuple[Term, Term]) -> PositionError:
    """Return how the filter treats the sum of two terms.

    If one is far slower than the other, the fast one alone is a state. Over the minutes that the slow one lasts, dead
    reckoning knows the position less well than that error is large, so nothing can tell it from the position.
    """
    fast, slow = sorted(terms, key=lambda term: term[1])
    if min(fast[0], slow[0]) > 0.0 and slow[1] > _FAR_APART * fast[1]:
        return PositionError(fast[0] ** 2, fast[1], slow[0] ** 2, slow[1])
    return PositionError(*one_term(tuple((max(sigma, _LEAST_M), tau_s) for sigma, tau_s in terms)))


def one_term(terms: tuple[Term, ...]) -> tuple[float, float]:
    """Return variance and time constant [s] of the one term nearest to the sum of several.

    Variance and the slope of the autocorrelation at lag 0 are those of the sum: exact over the seconds for which
    dead reckoning can tell the slow error from motion.

    Args:
        terms: Standard deviation and time constant [s] of each.
    """
    variance = plain_sum(sigma**2 for sigma, _ in terms)
    return variance, variance / plain_sum(sigma**2 / tau for sigma, tau in terms)


def bridging_term(variance: float, tau_s: float, constant: float) -> tuple[float, float]:
    """Return variance and time constant [s] of the term that stands for another one plus a constant error.

    The slope of its autocorrelation at lag 0 is that of the fast term. By its spectral density at frequency 0 the
    distance travelled in an outage of 30 s is as uncertain as both together make it.

    Args:
        variance: Variance of the fast term.
        tau_s: Time constant of it [s].
        constant: Variance of the constant error.
    """
    slope, density = variance / tau_s, 2.0 * variance * tau_s + constant * _BRIDGED_S
    return math.sqrt(0.5 * density * slope), math.sqrt(0.5 * density / slope)
