"""Noise of a receiver by the differences of its fixes at rest: white, and one Gauss-Markov term.

The mean square of differences at a lag t is 2·white² + 2·σ²·(1 − exp(−t/τ)), an axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

_TAUS_S: Final = np.geomspace(2.0, 3000.0, 150)


class ReceiverNoise(NamedTuple):
    """Noise of a receiver, an axis.

    Attributes:
        white_m: White part, 1 σ.
        slow_m: Gauss-Markov term, 1 σ.
        slow_s: Its correlation time.
    """

    white_m: float
    slow_m: float
    slow_s: float


def fitted_receiver(differences_m: Mapping[float, float]) -> ReceiverNoise:
    """Return the noise whose differences are nearest to those of a log, relative to their size.

    Args:
        differences_m: Root mean square of differences by lag [s].
    """
    lags, seen = np.array(list(differences_m)), np.square(list(differences_m.values()))
    found: list[tuple[float, ReceiverNoise]] = []
    for tau in _TAUS_S.tolist():
        design = 2.0 * np.column_stack([np.ones_like(lags), 1.0 - np.exp(-lags / tau)]) / seen[:, None]
        for used in ([0, 1], [1], [0]):
            variances = np.zeros(2)
            variances[used] = np.linalg.lstsq(design[:, used], np.ones_like(lags), rcond=None)[0]
            if (variances >= 0.0).all():
                cost = float(((design @ variances - 1.0) ** 2).sum())
                found.append((cost, ReceiverNoise(float(variances[0]) ** 0.5, float(variances[1]) ** 0.5, tau)))
                break
    return min(found)[1]
