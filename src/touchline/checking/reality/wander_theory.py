"""Lateral distances that a wandering course and the fixes' noise lead to, in theory, and the wander that fits best.

The course is off by a Gauss-Markov process over the distance, σ·exp(−|d|/ℓ); its integral has the covariance
σ²·(2ℓ·min(s, t) − ℓ²·(1 − e^(−s/ℓ) − e^(−t/ℓ) + e^(−|s−t|/ℓ))) at the distances s and t (A. Gelb, ed., "Applied Optimal
Estimation", 1974, sec. 3.8).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.reality.track_statistics import lateral_weights

Floats = NDArray[np.float64]

_LENGTHS_M: Final = np.geomspace(0.1, 30.0, 58)
_SIGMAS_RAD: Final = np.geomspace(1e-4, 0.2, 300)
_POINTS: Final = 41


class CourseWander(NamedTuple):
    """CourseWander of a course.

    Attributes:
        sigma_rad: Standard deviation of the course.
        length_m: Distance over which it is correlated.
    """

    sigma_rad: float
    length_m: float


def wander_variance(length_m: float, correlated_m: float) -> float:
    """Return the variance of the lateral distance after a length, for a course with a standard deviation of 1 rad.

    Args:
        length_m: Length over which a line is fitted, and after which the distance from it is taken.
        correlated_m: Distance ℓ over which the course is correlated.
    """
    places = np.linspace(-length_m, 0.0, _POINTS)
    weights = lateral_weights(places, length_m)
    s = np.append(places, length_m) + length_m
    decay = np.exp(-s / correlated_m)
    apart = np.exp(-np.abs(s[:, None] - s[None]) / correlated_m)
    covariance = 2.0 * correlated_m * np.minimum(s[:, None], s[None])
    covariance -= correlated_m**2 * (1.0 - decay[:, None] - decay[None] + apart)
    return float(weights @ covariance @ weights)


def noise_variance(length_m: float, spacing_m: float, white_m: float) -> float:
    """Return the variance of the lateral distance after a length by white noise of the fixes.

    Args:
        length_m: As in `wander_variance`.
        spacing_m: Distance between two fixes.
        white_m: Noise of a fix, 1 σ an axis.
    """
    places = np.arange(0.0, -length_m - 1e-9, -min(spacing_m, length_m / 3.0))
    return white_m**2 * float((lateral_weights(places, length_m) ** 2).sum())


def fitted_wander(sigmas_m: Mapping[int, float], spacing_m: float, white_m: float) -> CourseWander:
    """Return the wander whose lateral distances are nearest to those of a log, by the logarithm.

    Args:
        sigmas_m: Standard deviation of the lateral distance by length [m].
        spacing_m: Distance between two fixes.
        white_m: White noise of a fix, 1 σ an axis.
    """
    seen = np.log(np.array(list(sigmas_m.values())))
    noise = np.array([noise_variance(float(length), spacing_m, white_m) for length in sigmas_m])
    found: list[tuple[float, CourseWander]] = []
    for correlated in _LENGTHS_M.tolist():
        unit = np.array([wander_variance(float(length), correlated) for length in sigmas_m])
        misses = 0.5 * np.log(_SIGMAS_RAD[:, None] ** 2 * unit + noise) - seen
        costs = (misses**2).sum(axis=1)
        best = int(costs.argmin())
        found.append((float(costs[best]), CourseWander(float(_SIGMAS_RAD[best]), correlated)))
    return min(found)[1]
