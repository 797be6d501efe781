"""Noises of a recording: which of them is larger than the robot's files say, by the likelihood of its fixes.

Generalised likelihood ratio over named hypotheses (A. Willsky and H. Jones, "A generalized likelihood ratio approach to
the detection and estimation of jumps in linear systems", IEEE Trans. Automatic Control 21(1), 1976): the filter is run
with each noise at several sizes, and the best size of each is compared, less a penalty for having been chosen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.calibrating.drive_motion import moving_ticks
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun, rerun
from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.filter_model import FIX_DOF
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.setup import Setup

NAMED_FROM: Final = 10.0
"""Least advantage over the files' noises, as twice the difference of log-likelihoods, with which a noise is named."""
RUNNER_UP: Final = 6.0
"""Least advantage over the next one."""

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
    """Return the noises that are tried, in sizes relative to those of a robot's files, and larger."""
    white_m, slip, told_walk = config.gnss.white_m, config.drive.slip_relative, config.drive.side_slip_m_rtm
    told_m = math.hypot(config.gnss.gauss_markov_1_m, config.gnss.gauss_markov_2_m)
    return (
        Noise("fixes scatter", tuple({"gnss": {"white_m": white_m * by}} for by in (1.6, 2.5, 4.0, 8.0))),
        Noise(
            "fixes wander",
            tuple(
                {"gnss": {"gauss_markov_1_m": sigma_m, "gauss_markov_1_tau_s": tau_s, "gauss_markov_2_m": 0.0}}
                for sigma_m in (0.006, 0.012, 0.025, 0.05)
                for tau_s in (2.0, 6.0, 20.0)
                if sigma_m > told_m
            ),
        ),
        Noise(
            "the robot wanders sideways",
            tuple({"drive": {"side_slip_m_rtm": told_walk + walk}} for walk in (0.005, 0.01, 0.02, 0.04)),
        ),
        Noise("wheels slip", tuple({"drive": {"slip_relative": slip * by}} for by in (2.0, 4.0, 8.0))),
    )


def with_changes(config: OnboardConfig, changes: Changes) -> OnboardConfig:
    """Return a configuration with other values."""
    groups = {name: getattr(config, name).model_copy(update=dict(values)) for name, values in changes.items()}
    return config.model_copy(update=groups)


def log_likelihood(run: EstimatorRun, counted: NDArray[np.bool_]) -> float:
    """Return the log-likelihood of a run's fixes, up to a constant: bivariate t about the filter's prediction.

    Args:
        run: The run.
        counted: (ticks + 1,) whether a tick's fix counts; the same for runs that are compared.
    """
    white = run.white[counted & np.isfinite(run.white).all(axis=1)]
    nis = (white[:, :2] ** 2).sum(axis=1)
    return float(-0.5 * (white[:, 2] + (FIX_DOF + 2.0) * np.log1p(nis / (FIX_DOF - 2.0))).sum())


def best_noise(inputs: EstimatorInputs, setup: Setup, frames: FrameSeries) -> NoiseFit:
    """Return the noise that explains a recording best.

    Args:
        inputs: The recording.
        setup: Setup of the robot.
        frames: Its sensor frames.
    """

    def run_with(changes: Changes) -> EstimatorRun:
        noisy = setup.model_copy(update={"onboard": with_changes(setup.onboard, changes)})
        return rerun(inputs, noisy, frames, forgiving=True)

    run = run_with({})
    moving = moving_ticks(run)
    base, count = log_likelihood(run, moving), len(run.fixes)
    found: list[tuple[float, str, Changes]] = [(0.0, "", {})]
    for noise in noises_of(setup.onboard):
        scored = [(log_likelihood(run_with(size), moving), size) for size in noise.sizes]
        best, size = max(scored, key=lambda each: each[0])
        penalty = len(next(iter(size.values()))) * math.log(max(count, 2)) + 2.0 * math.log(len(noise.sizes))
        found.append((2.0 * (best - base) - penalty, noise.name, size))
    found.sort(key=lambda each: each[0], reverse=True)
    better, name, changes = found[0]
    if better < NAMED_FROM:
        better, name, changes = 0.0, "", {}
    second = next((each for each in found if each[1] != name), found[-1])
    return NoiseFit(name, changes, better, (second[1], second[0]))
