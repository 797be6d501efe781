"""Tables of comma-, semicolon- or tab-separated values with a line of column names."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, TextIO

import numpy as np

from touchline.schemas.plain_text import plain
from touchline.services.imports.log_table import LogContent, LogError, LogStream, LogTable

TIMES: Final = {
    "time_s": 1.0,
    "t": 1.0,
    "time": 1.0,
    "timestamp": 1.0,
    "time_ms": 1e-3,
    "time_us": 1e-6,
    "time_ns": 1e-9,
}
"""Names of the column that holds the time, and its unit [s]."""
_MOST_COLUMNS = 1000


class CsvLog:
    """One file, which is one stream under the name of the file without its ending."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with self._open() as text:
            line = text.readline(1_000_000)
            self._delimiter = max(",;\t", key=line.count)
            self._names = [
                name.strip().lstrip("#").strip() for name in next(csv.reader([line], delimiter=self._delimiter))
            ]
        self._time = next((name for name in self._names if name.lower() in TIMES), "")
        if not self._time:
            raise LogError(
                f"{path}: has no column with the time among {plain(', '.join(self._names), 200)}; "
                f"name one of them {', '.join(TIMES)}"
            )
        if len(self._names) > _MOST_COLUMNS:
            raise LogError(f"{path}: has {len(self._names):,} columns; give at most {_MOST_COLUMNS:,}")
        if len(set(self._names)) < len(self._names):
            raise LogError(f"{path}: has two columns of the same name; name each column once")

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Whether the file is a table: a text whose first line has names, a time among them, and separators."""
        line = begin.split(b"\n", 1)[0].lower()
        if b"\0" in begin or path.suffix.lower() not in (".csv", ".tsv", ".txt", ""):
            return False
        return path.suffix.lower() in (".csv", ".tsv") or (b"time" in line and any(c in line for c in b",;\t"))

    @property
    def _stream(self) -> str:
        return self._path.stem

    def streams(self) -> list[LogStream]:
        """See `LogReader`."""
        table = self.read([self._stream]).tables[self._stream]
        times = table.time_s[np.isfinite(table.time_s)]
        span = (float(times.min()), float(times.max())) if len(times) else (math.nan, math.nan)
        return [LogStream(self._stream, "csv", len(table.time_s), *span, note=plain(", ".join(self._names), 200))]

    def read(self, streams: Collection[str]) -> LogContent:
        """See `LogReader`."""
        found = LogContent()
        if self._stream not in streams:
            return found
        bad: list[int] = []
        rows = np.array(list(self._rows(bad)), dtype=np.float64).reshape(-1, len(self._names))
        if bad:
            shown = ", ".join(map(str, bad[:3]))
            found.problems.append(f"{self._path.name}: {len(bad):,} lines are no rows of the table (line {shown}…)")
        columns = {name: rows[:, i] for i, name in enumerate(self._names)}
        time_s = columns[self._time] * TIMES[self._time.lower()]
        found.tables[self._stream] = LogTable(self._stream, "csv", time_s, columns)
        return found

    def _rows(self, bad: list[int]) -> Iterator[list[float]]:
        with self._open() as text:
            reader = csv.reader(text, delimiter=self._delimiter)
            next(reader, None)
            try:
                for row in reader:
                    if not row or row[0].startswith("#"):
                        continue
                    if len(row) != len(self._names):
                        bad.append(reader.line_num)
                        continue
                    yield [_number(cell) for cell in row]
            except csv.Error as error:
                raise LogError(f"{self._path}: line {reader.line_num} cannot be read ({error})") from error

    def _open(self) -> TextIO:
        return self._path.open(encoding="utf-8-sig", errors="replace", newline="")


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan
