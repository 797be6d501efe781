"""Statistics of logs beside those of the emulator that is fitted to each."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from touchline.checking.reality.emulated_log import emulated
from touchline.checking.reality.log_fit import fit_log
from touchline.checking.reality.log_statistics import MEANINGS, log_statistics
from touchline.checking.reality.told import Told
from touchline_research.target_table import TargetRow, TargetTable

NEAR: Final = 0.15
"""Largest difference of the emulator from the log, as a share."""
_LIKELY: Final = 2.0
"""Standard deviations of single runs within which chance explains a difference."""
_FIRST_SEED: Final = 101
_COLUMNS: Final = ("statistic", "log", "emulator", "its seeds", "difference", "remark")

Progress = Callable[[str, float], None]


def run_reality_study(logs: Sequence[Path], seeds: int, progress: Progress) -> tuple[TargetTable, ...]:
    """Run the study: a table for each log.

    Args:
        logs: Recordings or imported logs.
        seeds: Number of emulations of each.
        progress: Called with the current log and the fraction of the study that is done.

    Raises:
        RecordingError: A log cannot be read.
        SpecError: A log has no session of a robot with GNSS, two wheels and sensors.
    """
    return tuple(
        _table(path, seeds, lambda done, at=at, path=path: progress(path.name, (at + done) / len(logs)))  # type: ignore[misc]
        for at, path in enumerate(logs)
    )


def _table(path: Path, seeds: int, progress: Callable[[float], None]) -> TargetTable:
    log, fit = fit_log(path, progress=lambda done: progress(0.3 * done))
    runs = []
    for number in range(seeds):  # not the seed that was fitted with
        scenario = fit.scenario.model_copy(update={"seed": _FIRST_SEED + number})
        runs.append(log_statistics(emulated(log, scenario, fit.imu_hz)))
        progress(0.3 + 0.7 * (number + 1) / seeds)
    rows = [beside(key, told.value, [run[key] for run in runs]) for key, told in fit.statistics.items() if told.value]
    note = f"{log.duration_s:,.0f} s, {float(log.antenna_track[-1, 2]):,.0f} m by its wheels; {seeds} seeds."
    return TargetTable(
        f"{path.stem} and the emulator fitted to it", _COLUMNS, tuple(rows), f"{note} {not_told(fit.statistics)}"
    )


def not_told(statistics: Mapping[str, Told]) -> str:
    """Return what a log does not tell, by the reasons; empty if it tells all.

    Args:
        statistics: Its statistics by the keys of `MEANINGS`.
    """
    reasons: dict[str, list[str]] = {}
    for key, told in statistics.items():
        if told.value is None:
            reasons.setdefault(told.untold, []).append(MEANINGS[key].name)
    parts = [f"{', '.join(names)} ({reason})" for reason, names in reasons.items()]
    return f"Not told: {'; '.join(parts)}." if parts else ""


def beside(key: str, log: float, runs: Sequence[Told]) -> TargetRow:
    """Return the row of a statistic.

    Args:
        key: The statistic, one of `MEANINGS`.
        log: That of the log, not 0.
        runs: Those of the emulations.
    """
    meaning = MEANINGS[key]
    name = f"{meaning.name} [{meaning.unit}]" if meaning.unit else meaning.name
    values = np.array([run.value for run in runs if run.value is not None])
    shown = f"{log * meaning.scale:.3g}"
    if len(values) < len(runs):
        untold = next(run.untold for run in runs if run.value is None)
        return TargetRow((name, shown, "", "", "", f"the emulation does not tell it: {untold}"), "≤ 15 %", False)
    mean, spread = float(values.mean()), float(values.std(ddof=1)) if len(values) > 1 else 0.0
    least, most = (f"{value * meaning.scale:.3g}" for value in (values.min(), values.max()))
    off = mean / log - 1.0
    chance = abs(mean - log) <= _LIKELY * spread * math.sqrt(1.0 + 1.0 / len(values))
    remark = "chance explains it" if abs(off) > NEAR and chance else ""
    return TargetRow(
        (name, shown, f"{mean * meaning.scale:.3g}", f"{least} to {most}", f"{100.0 * off:+.0f} %", remark),
        "≤ 15 %",
        abs(off) <= NEAR or chance,
        {"log": log, "emulator": mean, "spread": spread},
    )
