"""Withheld outages: fixes are kept from the estimator for a while, and the next one shows whether its σ was true."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimator_ticks import EstimatedTicks, EstimatorTicks
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import COVARIANCE, TWIST_COVARIANCE
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.setup import Setup

Floats = NDArray[np.float64]

LENGTHS_S: Final = (10, 30, 60)
WINDOWS: Final = 64
"""Most windows: 60 are needed to tell 95 % from less. Their starts slide over a log, so they may overlap."""
_LEAST_APART_S: Final = 5
_LATEST_S: Final = 1.0
"""Time after an outage by which the next fix has to have been measured."""


class Outages(NamedTuple):
    """Fixes after outages of one length.

    Attributes:
        length_s: Length.
        error_m: (n,) distance of the fix from its prediction.
        sigma_m: (n,) standard deviation of that, along the axis in which it is largest.
    """

    length_s: int
    error_m: Floats
    sigma_m: Floats

    @property
    def inside_3_sigma_pct(self) -> float:
        """Share of fixes within 3 σ; 98.9 % are expected of normal errors."""
        return 100.0 * float((self.error_m < 3.0 * self.sigma_m).mean())


def outages(inputs: EstimatorInputs, setup: Setup) -> list[Outages]:
    """Return the fixes after outages of each of `LENGTHS_S`, those with any.

    Args:
        inputs: The recording.
        setup: Setup of the robot, the recording's or another.
    """
    rows: dict[int, list[tuple[float, float]]] = {length_s: [] for length_s in LENGTHS_S}
    windows = _Windows(inputs, setup)
    for blind, first in windows.run():
        for length_s, found in rows.items():
            if (row := windows.fix_after(blind, first, length_s)) is not None:
                found.append(row)
    return [Outages(length_s, *np.array(found).T) for length_s, found in rows.items() if found]


class _Windows:
    """Estimator that is run on from many points of a recording without fixes."""

    def __init__(self, inputs: EstimatorInputs, setup: Setup) -> None:
        self._last, self._frames = inputs.last_tick, inputs.frames
        self._fixes = cast("NDArray[Any]", self._frames.fixes)
        self._blind = self._frames._replace(arrived=np.zeros_like(self._frames.arrived))
        self._most = max(LENGTHS_S) * TICKS_PER_S
        self._setup, self._may_jump = setup, setup.onboard.gnss.jump_fixes
        self._ticks = EstimatorTicks(setup, self._frames, self._most)

    def run(self) -> Iterator[tuple[EstimatedTicks, int]]:
        """Yield the estimates of each window, and its first row in the frames."""
        ticks = self._ticks
        apart = max(_LEAST_APART_S * TICKS_PER_S, (self._last - self._most) // WINDOWS)
        while ticks.done + apart + self._most <= self._last:
            self._go_on(ticks.done + apart)
            if not ticks.estimator.started:
                continue
            done, state = ticks.done, ticks.state
            ticks.frames = self._blind
            yield ticks.run(self._most), done
            ticks.frames = self._frames
            ticks.go_back(done, state)

    def _go_on(self, stop: int) -> None:
        """Run with fixes up to a row, accepting jumps."""
        ticks = self._ticks
        while ticks.done < stop:
            done, state, started = ticks.done, ticks.state, ticks.estimator.started
            found = ticks.run(stop - done)
            if self._may_jump is None or not started:
                continue
            outlying = np.flatnonzero(found.counters["fixes_outlying_run"] >= self._may_jump)
            if len(outlying):
                ticks.go_back(done, state)
                ticks.run(int(outlying[0]) + 1)
                ticks.estimator.accept_lasting_jump()

    def fix_after(self, blind: EstimatedTicks, first: int, length_s: int) -> tuple[float, float] | None:
        """Return how far the first RTK-fixed position after an outage is from its prediction; None without one.

        Args:
            blind: Estimates without fixes.
            first: Row of the first in the frames.
            length_s: Length of the outage.
        """
        end = first + length_s * TICKS_PER_S
        arrived = self._frames.arrived
        fixes = self._fixes[arrived[end - 1] : arrived[min(end + TICKS_PER_S, len(arrived) - 1)]]
        fixes = fixes[fixes["fix"] == FIX_FIXED]
        if not len(fixes):
            return None
        fix = fixes[0]
        at_s = float(fix["stamp_s"]) + self._setup.onboard.gnss.stamp_offset_s
        row = round(at_s * TICKS_PER_S) - self._frames.first_tick - first
        late = row - length_s * TICKS_PER_S
        if not -_LATEST_S * TICKS_PER_S < late < _LATEST_S * TICKS_PER_S:
            return None
        return self._compared(blind.rows[min(row, len(blind.rows) - 1)], fix)

    def _compared(self, row: Floats, fix: Any) -> tuple[float, float]:
        """Return the distance [m] and the larger σ [m]."""
        body, gnss = self._setup.vehicle.body, self._setup.onboard.gnss
        cos, sin = np.cos(row[2]), np.sin(row[2])
        arm_e = cos * body.gnss_antenna_x_m - sin * body.gnss_antenna_y_m
        arm_n = sin * body.gnss_antenna_x_m + cos * body.gnss_antenna_y_m
        jacobian = np.array([[1.0, 0.0, -arm_n], [0.0, 1.0, arm_e]])
        own_var = gnss.white_m**2 + gnss.gauss_markov_1_m**2 + gnss.gauss_markov_2_m**2
        spread = jacobian @ row[COVARIANCE:TWIST_COVARIANCE].reshape(3, 3) @ jacobian.T + own_var * np.eye(2)
        error = np.array([fix["east_m"] - row[0] - arm_e, fix["north_m"] - row[1] - arm_n])
        return float(np.hypot(*error)), float(np.sqrt(np.linalg.eigvalsh(spread)[-1]))
