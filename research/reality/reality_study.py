"""Statistics of logs beside those of the emulator that is fitted to each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

from touchline.checking.reality.emulator_beside import NEAR, EmulatedStatistic, all_beside
from touchline.checking.reality.log_fit import fit_log
from touchline.checking.reality.log_statistics import MEANINGS
from touchline.checking.reality.told import Told
from touchline_research.target_table import TargetRow, TargetTable

_MUST: Final = f"≤ {100 * NEAR:.0f} %"
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
    found = all_beside(log, fit, seeds, lambda done: progress(0.3 + 0.7 * done))
    note = f"{log.duration_s:,.0f} s, {float(log.antenna_track[-1, 2]):,.0f} m by its wheels; {seeds} seeds."
    return TargetTable(
        f"{path.stem} and the emulator fitted to it",
        _COLUMNS,
        tuple(row(key, each) for key, each in found.items()),
        f"{note} {not_told(fit.statistics)}",
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


def row(key: str, found: EmulatedStatistic) -> TargetRow:
    """Return the row of a statistic.

    Args:
        key: The statistic, one of `MEANINGS`.
        found: Log and emulations.
    """
    meaning = MEANINGS[key]
    name = f"{meaning.name} [{meaning.unit}]" if meaning.unit else meaning.name
    shown = f"{found.log * meaning.scale:.3g}"
    if found.untold:
        return TargetRow((name, shown, "", "", "", f"the emulation does not tell it: {found.untold}"), _MUST, False)
    least, most = (f"{value * meaning.scale:.3g}" for value in (min(found.values), max(found.values)))
    remark = "chance explains it" if abs(found.off) > NEAR and found.by_chance else ""
    return TargetRow(
        (name, shown, f"{found.mean * meaning.scale:.3g}", f"{least} to {most}", f"{100.0 * found.off:+.0f} %", remark),
        _MUST,
        found.met,
        {"log": found.log, "emulator": found.mean, "spread": found.spread},
    )
