"""Statistics of the emulator with a fitted scenario, beside those of the log."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from touchline.checking.reality.emulated_log import emulated
from touchline.checking.reality.log_samples import LogSamples
from touchline.checking.reality.log_statistics import log_statistics
from touchline.checking.reality.scenario_fit import ScenarioFit
from touchline.checking.reality.told import Told

NEAR: Final = 0.15
"""Largest difference of the emulator from the log, as a share."""
_LIKELY: Final = 2.0
"""Standard deviations of single runs within which chance explains a difference."""
_FIRST_SEED: Final = 101


class EmulatedStatistic(NamedTuple):
    """Statistic of a log beside those of its emulations.

    Attributes:
        log: That of the log, not 0.
        values: Those of the emulations that tell it.
        untold: Why one of them does not; empty if all do.
    """

    log: float
    values: tuple[float, ...]
    untold: str

    @property
    def mean(self) -> float:
        """Mean of the emulations."""
        return float(np.mean(self.values))

    @property
    def spread(self) -> float:
        """Standard deviation of single emulations; 0 of one."""
        return float(np.std(self.values, ddof=1)) if len(self.values) > 1 else 0.0

    @property
    def off(self) -> float:
        """Difference of the mean from the log, as a share of that."""
        return self.mean / self.log - 1.0

    @property
    def by_chance(self) -> bool:
        """True if the spread of the emulations explains the difference."""
        return abs(self.mean - self.log) <= _LIKELY * self.spread * math.sqrt(1.0 + 1.0 / len(self.values))

    @property
    def met(self) -> bool:
        """True if the emulator has the log's statistic."""
        return not self.untold and (abs(self.off) <= NEAR or self.by_chance)


def beside(log: float, runs: Sequence[Told]) -> EmulatedStatistic:
    """Return a statistic of a log beside that of runs of the emulator."""
    untold = next((run.untold for run in runs if run.value is None), "")
    return EmulatedStatistic(log, tuple(run.value for run in runs if run.value is not None), untold)


def all_beside(
    log: LogSamples, fit: ScenarioFit, seeds: int, progress: Callable[[float], None] = lambda done: None
) -> dict[str, EmulatedStatistic]:
    """Return all statistics that a log tells, beside emulations with seeds that it was not fitted with.

    Args:
        log: The log.
        fit: Scenario fitted to it.
        seeds: Number of emulations.
        progress: Called with the fraction done.
    """
    runs = []
    for number in range(seeds):
        scenario = fit.scenario.model_copy(update={"seed": _FIRST_SEED + number})
        runs.append(log_statistics(emulated(log, scenario, fit.imu_hz)))
        progress((number + 1) / seeds)
    told = {key: each.value for key, each in fit.statistics.items() if each.value}
    return {key: beside(value, [run[key] for run in runs]) for key, value in told.items()}
