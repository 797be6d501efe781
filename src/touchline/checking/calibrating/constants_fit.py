"""Least squares: the constants with which the filter's innovations are smallest.

The filter is run again on the recorded sensors with each constant changed a little, which gives the derivatives of its
innovations. Weighed by their own covariance they are the likelihood of the recording (prediction-error method:
L. Ljung, System Identification, 2nd ed., Prentice Hall 1999, section 7.4), so that a Gauss–Newton step solves what a
filter with the constants as further states would converge to (B. Friedland, "Treatment of bias in recursive filtering",
IEEE Trans. Automatic Control 14(4), 1969).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.calibrating.robot_constants import Constant, changed, with_sigmas
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun, rerun
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.filter_model import FIX_DOF
from touchline.schemas.errors import SpecError
from touchline.schemas.setup import Setup

Floats = NDArray[np.float64]

LEAST_FIXES: Final = 150
"""Fewest RTK-fixed positions from which constants can be told."""
_DELAY_TICKS: Final = 25
_TRUST: Final = (10.0, 5.0, 2.0)
"""Factors on the receiver's σ in the first rounds, so that wrong constants do not have fixes rejected."""
_MOST_ROUNDS: Final = 12
_CONVERGED: Final = 0.05
"""Change in σ below which it has converged."""


class Fit(NamedTuple):
    """Constants of a recording.

    Attributes:
        changes: (k,) changes of the constants.
        covariance: (k, k) their covariance; what was known before is in it.
        halves: (2, k) changes that either half of the recording alone would ask for in the last round.
        halves_sigma: (2, k) standard deviations of those.
        run: Estimator run with the changed constants.
        converged: Whether further rounds would change nothing.
    """

    changes: Floats
    covariance: Floats
    halves: Floats
    halves_sigma: Floats
    run: EstimatorRun
    converged: bool


def fit_constants(
    inputs: EstimatorInputs,
    setup: Setup,
    constants: Sequence[Constant],
    progress: Callable[[float], None] = lambda done: None,
) -> Fit:
    """Return the constants that fit a recording best.

    Args:
        inputs: The recording.
        setup: Setup of the robot, with the noises that its filter assumes.
        constants: Constants to be found.
        progress: Called with the fraction done.

    Raises:
        NotRebuilt: The recording has no sensor frames.
        SpecError: It has too few RTK-fixed positions.
    """
    runs = _Runs(inputs, setup, constants)
    start = np.array([constant.start_sigma for constant in constants])
    found, last = np.zeros(len(constants)), np.zeros(len(constants))
    done, share = 0, 1.0
    while True:
        trust = _TRUST[done] if done < len(_TRUST) else 1.0
        white, slopes = runs.innovations(found * start, trust)
        target, covariance = _solved(white, slopes)
        # The prior is about no change at all, so the step has to give back a part of what has been found.
        step = target - covariance @ found
        # Innovations jump where a stamp offset moves fixes to another tick: a step may turn back there for ever.
        if done > len(_TRUST) and step @ np.linalg.solve(covariance, last) < 0.0:
            share *= 0.5
        step *= share
        found, last = found + step, step
        done += 1
        converged = done > len(_TRUST) and bool((np.abs(step) < _CONVERGED * np.sqrt(np.diag(covariance))).all())
        progress(done / _MOST_ROUNDS)
        if converged or done == _MOST_ROUNDS:
            break
    middle = len(white) // 2
    halves = [_solved(white[half], slopes[half]) for half in (slice(middle), slice(middle, None))]
    return Fit(
        found * start,
        covariance * np.outer(start, start),
        np.array([solution for solution, _ in halves]) * start,
        np.array([np.sqrt(np.diag(each)) for _, each in halves]) * start,
        runs.run(found * start, 1.0),
        converged,
    )


class _Runs:
    """Estimator runs with changed constants."""

    def __init__(self, inputs: EstimatorInputs, setup: Setup, constants: Sequence[Constant]) -> None:
        certain = with_sigmas(setup, dict.fromkeys(constants, 0.0))  # the filter is to leave them as they are
        self._inputs, self._setup, self._constants = inputs, certain, constants
        self._frames = _delayed(inputs.frames)
        fixed = int((cast("NDArray[Any]", self._frames.fixes)["fix"] == FIX_FIXED).sum())
        if fixed < LEAST_FIXES:
            problem = f"has {fixed} RTK-fixed positions among {len(self._frames.fixes)} fixes"
            raise SpecError("the recording", "", problem, f"record a drive with at least {LEAST_FIXES}")

    def run(self, changes: Floats, trust: float) -> EstimatorRun:
        """Run the estimator with (k,) changed constants and a receiver whose σ is `trust` times that of its sheet."""
        setup = changed(self._setup, dict(zip(self._constants, changes.tolist(), strict=True)))
        sheet = setup.onboard.gnss
        loose = sheet.model_copy(update={"white_m": sheet.white_m * trust})
        onboard = setup.onboard.model_copy(update={"gnss": loose})
        return rerun(self._inputs, setup.model_copy(update={"onboard": onboard}), self._frames, forgiving=True)

    def innovations(self, changes: Floats, trust: float) -> tuple[Floats, Floats]:
        """Return (n, 2) whitened innovations of fixes, and (n, 2, k) derivatives by constants over their start σ."""
        white, slopes = self.run(changes, trust).white[:, :2], []
        for index, constant in enumerate(self._constants):
            moved = changes.copy()
            moved[index] += constant.step
            slope = (self.run(moved, trust).white[:, :2] - white) * (constant.start_sigma / constant.step)
            slopes.append(slope)
        by_constant = np.stack(slopes, axis=-1)
        # A small change may decide whether a fix is taken; what follows from that is no derivative.
        smooth = np.isfinite(white).all(axis=1) & np.isfinite(by_constant).all(axis=(1, 2))
        limits = np.array([constant.start_sigma / constant.step for constant in self._constants])
        smooth &= (np.abs(np.nan_to_num(by_constant)) < limits).all(axis=(1, 2))
        return white[smooth], by_constant[smooth]


def _solved(white: Floats, slopes: Floats) -> tuple[Floats, Floats]:
    """Return the (k,) changes that make innovations least, and their (k, k) covariance, in multiples of σ at the start.

    Innovations of unlikely fixes are weighed as the filter does.
    """
    weights = (FIX_DOF + 2.0) / (FIX_DOF - 2.0 + (white**2).sum(axis=1))
    information = np.einsum("n,nak,nal->kl", weights, slopes, slopes) + np.eye(slopes.shape[2])
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return -covariance @ np.einsum("n,nak,na->k", weights, slopes, white), covariance


def _delayed(frames: FrameSeries) -> FrameSeries:
    """Return frames whose fixes arrive later, so that one which was measured after its stamp still is in the past."""
    first = np.full(_DELAY_TICKS, frames.arrived[0])
    return frames._replace(arrived=np.concatenate((first, frames.arrived[:-_DELAY_TICKS])))
