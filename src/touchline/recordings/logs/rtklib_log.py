"""Solutions of RTKLIB and its forks: ``.pos`` files in degrees, of any of their time formats."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np

from touchline.recordings.logs.foreign_sensors import FIXED, FLOAT, SINGLE
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream, LogTable
from touchline.schemas.plain_text import plain

_KINDS: Final = {1: FIXED, 2: FLOAT, 3: SINGLE, 4: SINGLE, 5: SINGLE, 6: FLOAT}
"""Kinds by RTKLIB's Q: fixed, float, SBAS, DGPS, single, PPP."""
_WEEK_S: Final = 604800.0
_COLUMNS: Final = (
    "latitude_deg",
    "longitude_deg",
    "altitude_m",
    "q",
    "satellites",
    "sigma_north_m",
    "sigma_east_m",
    "sigma_up_m",
    "sdne_m",
    "sdeu_m",
    "sdun_m",
    "age_s",
    "ratio",
)
_LEAST = 5
_DATE = re.compile(r"\d{4}/\d\d?/\d\d?$")


class RtklibLog:
    """Reader of one file: one stream, ``solution``."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._content: LogContent | None = None

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Return whether it is such a file by its name, or by RTKLIB's beginning."""
        return path.suffix.lower() == ".pos" or begin.startswith((b"% program", b"% obs start", b"%  GPST", b"%  UTC"))

    def streams(self) -> list[LogStream]:
        """Return the stream, as of `LogReader`."""
        table = self._table()
        span = (float(table.time_s.min()), float(table.time_s.max())) if len(table.time_s) else (math.nan, math.nan)
        return [LogStream(table.stream, table.kind, len(table.time_s), *span)]

    def read(self, streams: Collection[str]) -> LogContent:
        """Read the solution, as of `LogReader`."""
        self._table()
        assert self._content is not None
        return self._content if "solution" in streams else LogContent()

    def _table(self) -> LogTable:
        if self._content is None:
            bad: list[int] = []
            rows = np.array(list(self._rows(bad)), dtype=np.float64).reshape(-1, len(_COLUMNS) + 1)
            if not len(rows):
                raise LogError(f"{self._path}: has no line with time, latitude and longitude in degrees; export it so")
            columns = {name: rows[:, i + 1] for i, name in enumerate(_COLUMNS)}
            kinds = np.array([_KINDS.get(int(q), 0) for q in np.nan_to_num(columns["q"])], dtype=np.float64)
            table = LogTable("solution", "rtklib/pos", rows[:, 0], {**columns, "fix": kinds})
            note = f"{self._path.name}: {len(bad):,} lines cannot be read (line {', '.join(map(str, bad[:3]))}…)"
            self._content = LogContent({table.stream: table}, [note] if bad else [])
        return self._content.tables["solution"]

    def _rows(self, bad: list[int]) -> Iterator[list[float]]:
        separator = None
        with self._path.open(encoding="utf-8", errors="replace") as text:
            for number, line in enumerate(text, 1):
                if line.startswith("%"):
                    if "x-ecef" in line or "e-baseline" in line or "latitude(d'" in line:
                        kind = plain(line.strip("% \n"), 60)
                        raise LogError(f"{self._path}: is not in degrees ({kind}); export latitude, longitude, height")
                    continue
                if not line.strip():
                    continue
                separator = separator or (
                    "," if line.count(",") > _LEAST else ";" if line.count(";") > _LEAST else None
                )
                row = _row(line.split(separator))
                if row is None:
                    bad.append(number)
                else:
                    yield row


def _row(cells: list[str]) -> list[float] | None:
    """Return time and columns of a line; None if it has none."""
    try:
        cells = [cell.strip() for cell in cells]
        if _DATE.match(cells[0]):
            time_s = _calendar_s(cells[0], cells[1])
        else:  # GPS week and time of the week
            time_s = float(cells[0]) * _WEEK_S + float(cells[1])
        values = [float(cell) for cell in cells[2 : 2 + len(_COLUMNS)] if cell]
    except (ValueError, IndexError, OverflowError):
        return None
    if len(values) < _LEAST or not -90 <= values[0] <= 90 or not -360 <= values[1] <= 360:
        return None
    return [time_s, *values, *[math.nan] * (len(_COLUMNS) - len(values))]


def _calendar_s(date: str, clock: str) -> float:
    """Return seconds since 1970 of a date and a time of the file's own scale, GPS or UTC."""
    year, month, day = map(int, date.split("/"))
    hour, minute, second = clock.split(":")
    midnight = datetime(year, month, day, tzinfo=UTC).timestamp()
    return midnight + 3600 * int(hour) + 60 * int(minute) + float(second)
