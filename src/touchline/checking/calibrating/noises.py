"""Noises of a recording: which of them is larger than the robot's files say, by the likelihood of its fixes.

Generalised likelihood ratio over named hypotheses (A. Willsky and H. Jones, "A generalized likelihood ratio approach to
the detection and estimation of jumps in linear systems", IEEE Trans. Automatic Control 21(1), 1976): the filter is run
with each noise at several sizes, and the best size of each is compared, less a penalty for having been chosen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.calibrating.drive_motion import moving_ticks
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun, rerun
from touchline.onboard.computer_state import ReceivedFix
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.filter_model import FIX_DOF
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.setup import Setup

NAMED_FROM: Final = 30.0
"""Least advantage over the files' noises, as twice the difference of log-likelihoods, with which a noise is named.

It is 24 at most in 31 of 32 emulated tennis jobs without such a noise."""
_STRETCH_TICKS: Final = 500
"""Length of the stretches of which most have to speak for fixes that wander."""
RUNNER_UP: Final = 6.0
"""Least advantage over the next one."""
FIXES_WANDER: Final = "fixes wander"
ROBOT_WANDERS: Final = "the robot wanders sideways"

Changes = Mapping[str, Mapping[str, float]]
"""Values of the computer's configuration, by group and field."""


class Noise(NamedTuple):
    """A noise that may be larger than the files say.

    Attributes:
        name: Name for people.
        sizes: Values to be tried.
    """

    name: str
    sizes: tuple[Changes, ...]


class NoiseFit(NamedTuple):
    """Noise that explains a recording best.

    Attributes:
        name: Its name; empty for those of the files.
        changes: Values of the computer's configuration.
        better: Advantage over those of the files, as twice the difference of log-likelihoods less the penalty.
        runner_up: The next one's name and advantage.
    """

    name: str
    changes: Changes
    better: float
    runner_up: tuple[str, float]

    @property
    def told(self) -> bool:
        """True if no other noise explains the recording nearly as well."""
        return self.better - self.runner_up[1] >= RUNNER_UP


def noises_of(config: OnboardConfig) -> tuple[Noise, ...]:
    """Return the noises that are tried, in sizes relative to those of a robot's files, and larger.

    A robot wanders by a walk, or by an angle between where it heads and where it goes that changes within a metre. The
    filter has no such angle: to its fixes a gyro that is noisier looks the same.
    """
    white_m, slip, told_walk = config.gnss.white_m, config.drive.slip_relative, config.drive.side_slip_m_rtm
    walks = tuple({"drive": {"side_slip_m_rtm": told_walk + walk}} for walk in (0.0015, 0.003, 0.006, 0.012, 0.03))
    told_turn = config.imu.gyro_density_radps_rthz
    turns = tuple({"imu": {"gyro_density_radps_rthz": told_turn + turn}} for turn in (0.003, 0.006, 0.012))
    return (
        Noise("fixes scatter", tuple({"gnss": {"white_m": white_m * by}} for by in (1.6, 2.5, 4.0, 8.0))),
        Noise(FIXES_WANDER, tuple(_slow(config, by, tau_s) for by in (2.0, 4.0, 8.0) for tau_s in (2.0, 6.0, 20.0))),
        Noise(ROBOT_WANDERS, walks + turns),
        Noise("wheels slip", tuple({"drive": {"slip_relative": slip * by}} for by in (2.0, 4.0, 8.0))),
    )


def as_told(config: OnboardConfig) -> tuple[Changes, ...]:
    """Return noises of the size in a robot's files: as there, and with other correlation times of the fixes' errors."""
    return ({}, *(_slow(config, 1.0, tau_s) for tau_s in (6.0, 20.0)))


def _slow(config: OnboardConfig, by: float, tau_s: float) -> Changes:
    """Return one correlated error of fixes, so many times as large as all of them in a robot's files."""
    told_m = math.hypot(config.gnss.gauss_markov_1_m, config.gnss.gauss_markov_2_m)
    return {"gnss": {"gauss_markov_1_m": by * told_m, "gauss_markov_1_tau_s": tau_s, "gauss_markov_2_m": 0.0}}


def with_changes(config: OnboardConfig, changes: Changes) -> OnboardConfig:
    """Return a configuration with other values."""
    groups = {name: getattr(config, name).model_copy(update=dict(values)) for name, values in changes.items()}
    return config.model_copy(update=groups)


def log_likelihoods(run: EstimatorRun, counted: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return (ticks + 1,) log-likelihoods of fixes, up to a constant: bivariate t about the filter's prediction.

    Args:
        run: The run.
        counted: (ticks + 1,) whether a tick's fix counts, others are 0; the same for runs that are compared.
    """
    nis = (run.white[:, :2] ** 2).sum(axis=1)
    found = -0.5 * (run.white[:, 2] + (FIX_DOF + 2.0) * np.log1p(nis / (FIX_DOF - 2.0)))
    return np.where(counted & np.isfinite(found), found, 0.0)


def lasts(gains: NDArray[np.float64]) -> bool:
    """Return whether most stretches of a drive speak for a noise.

    A receiver of the files errs in bursts, for which the filter has one noise that is always there. In a drive with
    more of them than usual fixes that wander are likelier in sum, but not in the stretches between.

    Args:
        gains: (ticks + 1,) advantages of the noise in log-likelihood; 0 where no fix counts.
    """
    starts = np.arange(0, len(gains), _STRETCH_TICKS)
    by_stretch = np.add.reduceat(gains, starts)
    spoken = by_stretch[np.logical_or.reduceat(gains != 0.0, starts)]
    return len(spoken) > 0 and bool(np.median(spoken) > 0.0)


def best_noise(inputs: EstimatorInputs, setup: Setup, frames: FrameSeries) -> NoiseFit:
    """Return the noise that explains a recording best.

    What the receiver reports of its accuracy is left out: the question is what the files say.

    Args:
        inputs: The recording.
        setup: Setup of the robot.
        frames: Its sensor frames.
    """
    silent = _silent(frames)

    def run_with(config: OnboardConfig) -> EstimatorRun:
        return rerun(inputs, setup.model_copy(update={"onboard": config}), silent, forgiving=True)

    told = [with_changes(setup.onboard, changes) for changes in as_told(setup.onboard)]
    runs = [run_with(config) for config in told]
    moving = moving_ticks(runs[0])
    likelihoods = [log_likelihoods(run, moving) for run in runs]
    best_told = max(range(len(told)), key=lambda i: float(likelihoods[i].sum()))
    base, config, count = likelihoods[best_told], told[best_told], len(runs[0].fixes)
    found: list[tuple[float, str, Changes]] = [(0.0, "", {})]
    for noise in noises_of(setup.onboard):
        scored = [(log_likelihoods(run_with(with_changes(config, size)), moving) - base, size) for size in noise.sizes]
        if noise.name == FIXES_WANDER:
            scored = [each for each in scored if lasts(each[0])]
        if not scored:
            continue
        best, size = max(scored, key=lambda each: float(each[0].sum()))
        penalty = len(next(iter(size.values()))) * math.log(max(count, 2)) + 2.0 * math.log(len(noise.sizes))
        found.append((2.0 * float(best.sum()) - penalty, noise.name, size))
    found.sort(key=lambda each: each[0], reverse=True)
    better, name, changes = found[0]
    if better < NAMED_FROM:
        better, name, changes = 0.0, "", {}
    second = next((each for each in found if each[1] != name), found[-1])
    return NoiseFit(name, changes, better, (second[1], second[0]))


def _silent(frames: FrameSeries) -> FrameSeries:
    """Return frames whose RTK-fixed positions report no σ."""
    fixes = cast("NDArray[Any]", frames.fixes).copy()
    fixes["variance_m2"][fixes["fix"] == FIX_FIXED] = 0.0
    return frames._replace(fixes=cast("Sequence[ReceivedFix]", fixes))
