"""First-order Gauss-Markov terms that stand for several errors of a sensor."""

from __future__ import annotations

import math
from typing import Final

from touchline.core.plain_sum import plain_sum

_BRIDGED_S: Final = 30.0  # outage over which the reported σ has to cover the error


def one_term(terms: tuple[tuple[float, float], ...]) -> tuple[float, float]:
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
