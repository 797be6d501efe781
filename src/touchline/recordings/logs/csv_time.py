"""Times in tables: numbers in a unit, ISO 8601, a date and a time of day, GPS week and time of the week."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np

from touchline.recordings.logs.csv_columns import plain_name
from touchline.recordings.logs.log_table import Floats, LogError
from touchline.schemas.plain_text import plain

_UNIT_S: Final[Mapping[str, float]] = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs", "usec", "micros", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanoseconds"), 1e-9),
}
_NAMES: Final = (
    "time t timestamp stamp epoch unix unix_time unixtime unix_timestamp posix utc datetime date_time "
    "time_utc utc_time gps_time elapsed elapsed_time system_time"
)
_STEMS: Final = tuple(_NAMES.split())
_OTHERS: Final = {
    "timeus": 1e-6,
    "timems": 1e-3,
    "seconds": 1.0,
    "sec": 1.0,
    "secs": 1.0,
    "millis": 1e-3,
    "micros": 1e-6,
    "rosbagtimestamp": 1e-9,
    "header_stamp": 1e-9,
}
_WEEKS: Final = ("week", "gps_week", "gpsweek", "gps_week_number", "wn")
_TOWS: Final = {"tow": 1.0, "gps_tow": 1.0, "tow_s": 1.0, "gps_seconds": 1.0, "sow": 1.0, "itow": 1e-3, "tow_ms": 1e-3}
_WEEK_S: Final = 604_800.0
_GPS_EPOCH_S: Final = 315_964_800.0  # 6 January 1980
_DAY_S: Final = 86_400.0
_COARSE: Final = 10.0  # whole numbers that step by more are hardly seconds
_EPOCHS: Final = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Sizes from which numbers are ns, µs and ms since 1970; a time in seconds as large would be in the year 5138."""
_DOTTED: Final = re.compile(r"(\d\d?)\.(\d\d?)\.(\d{4})")
_SLASHED: Final = re.compile(r"(\d{4})/(\d\d?)/(\d\d?)")
REMEDY: Final = "name one of them time_s, time_ms, time_us or time_ns for numbers, or time for ISO 8601"


class TimeError(ValueError):
    """Unreadable time; the message names the column and the remedy."""


def time_columns(names: Sequence[str]) -> list[list[str]]:
    """Return choices of columns that together hold the time, the best first; empty if there are none.

    Each is one column, date and time of day, or GPS week and time of the week.
    """
    plain_names = {plain_name(name)[0]: name for name in names}
    weeks = [plain_names[each] for each in _WEEKS if each in plain_names]
    tows = [plain_names[each] for each in _TOWS if each in plain_names]
    alone = [name for name in names if _unit_s(name) is not None]
    stamped = alone[0] if alone else None
    dates = [plain_names[each] for each in ("date", "day", "date_utc", "utc_date") if each in plain_names]
    if dates and stamped is not None and plain_name(stamped)[0] in ("time", "utc", "utc_time", "time_utc"):
        return [[dates[0], stamped], *([name] for name in alone)]
    if stamped is None and weeks and tows:
        return [[weeks[0], tows[0]]]
    return [[name] for name in alone or dates[:1]]


def first_times(
    path: Path, choices: Sequence[Sequence[str]], texts: Mapping[str, Sequence[str]], numbers: Mapping[str, Floats]
) -> tuple[Floats, list[str]]:
    """Return (n,) seconds by the first of several choices of columns that can be read, and what could not be.

    Args:
        path: The file, for messages.
        choices: Columns, as `time_columns` finds them.
        texts: (n,) cells of each.
        numbers: (n,) numbers of each.

    Raises:
        LogError: None of them is a time.
    """
    problems: list[str] = []
    for names in choices:
        try:
            found = times_of(names, [texts[name] for name in names], [numbers[name] for name in names])
        except TimeError as error:
            problems.append(f"{path}: {error}")
        else:
            by = " and ".join(map(repr, names))
            return found, [f"{problem}; the time is that of {by}" for problem in problems]
    raise LogError(problems[0])


def _unit_s(name: str) -> float | None:
    """Return the seconds of a column's unit; 0 if its name does not say, None if it is no time."""
    bare, unit = plain_name(name)
    if bare in _OTHERS:
        return _OTHERS[bare]
    stem, _, ending = bare.rpartition("_")
    if bare in _STEMS:
        return _UNIT_S.get(unit, 0.0)
    return _UNIT_S[ending] if stem in _STEMS and ending in _UNIT_S else None


def times_of(names: Sequence[str], cells: Sequence[Sequence[str]], numbers: Sequence[Floats]) -> Floats:
    """Return (n,) seconds; NaN where a row has no time.

    Args:
        names: Columns, as `time_columns` finds them.
        cells: (n,) texts of each.
        numbers: (n,) numbers of each; NaN where a text is none.

    Raises:
        TimeError: A column is no time, or its unit is unknown.
    """
    bare = [plain_name(name)[0] for name in names]
    if bare[0] in _WEEKS:
        return _GPS_EPOCH_S + _WEEK_S * numbers[0] + _TOWS[bare[1]] * numbers[1]
    if np.isfinite(numbers[-1]).any() and len(names) == 1:
        return numbers[0] * (_unit_s(names[0]) or _unit_of(names[0], numbers[0]))
    texts = [" ".join(parts) for parts in zip(*cells, strict=True)]
    found = np.array([_calendar_s(text) for text in texts], dtype=np.float64)
    if len(found) and not np.isfinite(found).any():
        shown = plain(next((text for text in texts if text.strip()), ""), 40)
        remedy = "give ISO 8601, as in 2024-07-01T10:00:00.5Z, or seconds in a column time_s"
        raise TimeError(f"the column {' and '.join(map(repr, names))} has no time in {shown!r}; {remedy}")
    if len(found) and np.nanmax(found) < 2 * _DAY_S:  # times of the day: each within half a day of the one before
        there = np.isfinite(found)
        found[there] = np.unwrap(found[there], period=_DAY_S)
    return found


def _unit_of(name: str, numbers: Floats) -> float:
    """Return the seconds of the unit of a column whose name does not say, by the size of its numbers."""
    known = numbers[np.isfinite(numbers)]
    size = float(np.median(np.abs(known)))
    for least, unit_s in _EPOCHS:
        if size >= least:
            return unit_s
    steps = np.abs(np.diff(known))
    steps = steps[steps > 0.0]
    whole = bool((known == np.round(known)).all())
    if whole and len(steps) and float(np.median(steps)) >= _COARSE:
        raise TimeError(
            f"the column {name!r} steps by {float(np.median(steps)):g} in an unknown unit; "
            "name it time_ms or time_us if that is its unit, time_s if it is seconds"
        )
    return 1.0


def _calendar_s(text: str) -> float:
    """Return seconds since 1970, or since midnight of a time of day; NaN if it is none. Without a zone it is UTC."""
    given = _SLASHED.sub(r"\1-\2-\3", _DOTTED.sub(r"\3-\2-\1", text.strip().strip('"')))
    given = re.sub(r"\s*(UTC|GMT)$", "Z", given).replace(",", ".")
    given = re.sub(r"(?<![\d.])(\d)(?![\d.])", r"0\1", given)
    try:
        if re.match(r"\d\d:\d\d", given):
            moment = datetime.fromisoformat(f"1970-01-01T{given}")
        else:
            moment = datetime.fromisoformat(given)
    except ValueError:
        return float("nan")
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
