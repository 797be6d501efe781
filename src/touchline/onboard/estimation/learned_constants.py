"""Constants of the robot as the estimator has learned them, beside what the robot's files say."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.filter_model import CONSTANTS, VARYING, FilterCounters, FilterFigures
from touchline.schemas.onboard import Calibrated, GnssSheet, ImuSheet

Floats = NDArray[np.float64]

NAMES: Final = ("gyro scale", "antenna forward", "antenna left", "stamp offset")
"""Names for people, in the order of the states; this and all following."""
UNITS: Final = ("%", "mm", "mm", "ms")
_SHOWN: Final = (100.0, 1000.0, 1000.0, 1000.0)
FLOORS: Final = (2e-4, 0.002, 0.002, 0.002)
"""Smallest σ that is claimed, in SI units: slip that the estimator does not model looks like that much."""
_LEAST: Final = (8e-4, 0.004, 0.004, 0.005)
"""Smallest difference from the files that is reported."""
_GROWTH: Final = (5e-4, 0.002, 0.002, 0.002)
"""σ by which they have changed a month after their calibration [assumed]: temperature, load, a mast that is touched."""
_MONTH_DAYS: Final = 30.0
_UNCALIBRATED: Final = (
    ImuSheet().gyro_scale_sigma,
    GnssSheet().antenna_sigma_m,
    GnssSheet().antenna_sigma_m,
    GnssSheet().stamp_offset_sigma_s,
)
"""σ up to which they grow."""
_CERTAIN: Final = 5.5
"""σ from which a difference is reported."""
SLIPPING: Final = 0.01
"""Share of rejected wheel readings from which nothing is said of constants: wheels that slip look like an arm and a
delay."""
_TOLD: Final = 0.5
"""Share of its σ at the start that a constant's is at most once motion has told it."""


class LearnedConstant(NamedTuple):
    """Constant of the robot.

    Attributes:
        name: Name for people.
        difference: Its value less that of the robot's files, in `unit`.
        sigma: Standard deviation of that.
        unit: Unit for people.
        told: Whether the motion so far has told it.
    """

    name: str
    difference: float
    sigma: float
    unit: str
    told: bool

    def __str__(self) -> str:
        """Return the sentence about a difference."""
        return f"{self.name} differs from the robot's files by {self.difference:+.2g} ± {self.sigma:.1g} {self.unit}"


def start_variance(index: int, sigma: float, calibrated: Calibrated | None) -> float:
    """Return the variance of a constant at the start: it grows with the time since its calibration.

    Args:
        index: Its number, in the order of the states.
        sigma: σ in the configuration; 0 stays, the constant is not to be estimated.
        calibrated: Calibration that it is from; None: there was none.
    """
    if calibrated is None or sigma == 0.0:
        return sigma**2
    grown = sigma**2 + _GROWTH[index] ** 2 * calibrated.age_days / _MONTH_DAYS
    return max(sigma**2, min(grown, _UNCALIBRATED[index] ** 2))


def learned_constants(state: Floats, covariance: Floats, figures: FilterFigures) -> tuple[LearnedConstant, ...]:
    """Return the constants, in the order of the states; one whose σ at the start is 0 is never told.

    Args:
        state: (STATES,) state of the filter.
        covariance: (STATES, STATES) its covariance.
        figures: Figures of the filter.
    """
    sigmas = np.maximum(np.sqrt(np.diag(covariance)[CONSTANTS]), FLOORS)
    told = sigmas <= _TOLD * np.sqrt(figures.constant_var)
    rows = zip(NAMES, state[CONSTANTS], sigmas, UNITS, told, _SHOWN, strict=True)
    return tuple(
        LearnedConstant(name, float(value) * shown, float(sigma) * shown, unit, bool(known))
        for name, value, sigma, unit, known, shown in rows
    )


@kernel
def note_differences(x: Floats, P: Floats, n: FilterCounters) -> None:
    """Note which constants differ from the robot's files for certain.

    A robot that wanders looks like a gyro with another scale for a while, and wheels that slip like a delay. So nothing
    is noted until the unrest of innovations is known, while they are correlated, or if wheels slip; and where they are
    restless σ counts as much larger as the square root of their unrest.

    Args:
        x: (STATES,) state.
        P: (STATES, STATES) its covariance.
        n: Counters, updated.
    """
    if n.inconsistent or n.fix_unrest == 0.0 or n.encoders_rejected > SLIPPING * n.encoders:
        return
    certain = _CERTAIN * math.sqrt(max(n.fix_unrest, 1.0))
    for i in range(len(_LEAST)):
        k = VARYING + i
        if abs(x[k]) > max(certain * math.sqrt(P[k, k]), _LEAST[i]):
            n.differing |= 1 << i
