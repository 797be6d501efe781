"""Tables of comma-, semicolon-, tab- or bar-separated values with a line of column names."""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Collection, Iterator
from itertools import islice
from pathlib import Path
from typing import Final, TextIO

import numpy as np

from touchline.recordings.logs.csv_columns import mistaken_degrees, with_usual_names
from touchline.recordings.logs.csv_time import REMEDY, first_times, time_columns
from touchline.recordings.logs.fix_kinds import FIX_KIND, kind_columns, kinds_of
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream, LogTable
from touchline.schemas.plain_text import plain

_MOST_COLUMNS = 1000
_SEPARATORS: Final = ",;\t|"
_COMMENTS: Final = ("#", "%", "//")
_SEARCHED_LINES: Final = 100
_LONGEST_LINE: Final = 1_000_000
_GROUPED: Final = re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d+")
_UTF16: Final = (b"\xff\xfe", b"\xfe\xff")


class CsvLog:
    """Reader of one file: one stream, named as the file without its ending."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with path.open("rb") as raw:
            self._encoding = "utf-16" if raw.read(2) in _UTF16 else "utf-8-sig"
        with self._open() as text:
            lines = list(_lines(text))
        found = _header(lines)
        if found is None:
            first = plain(next((line.strip() for line in lines if line.strip()), ""), 200)
            raise LogError(f"{path}: has no column with the time among {first}; {REMEDY}")
        self._skipped, self._delimiter, self._names, self._times = found
        if len(self._names) > _MOST_COLUMNS:
            raise LogError(f"{path}: has {len(self._names):,} columns; give at most {_MOST_COLUMNS:,}")
        if len(set(self._names)) < len(self._names):
            raise LogError(f"{path}: has two columns of the same name; name each column once")

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Return whether the file is a table: text with separators and a line of names, a time among them."""
        if path.suffix.lower() not in (".csv", ".tsv", ".txt", ""):
            return False
        if b"\0" in begin and not begin.startswith(_UTF16):
            return False
        text = begin.decode("utf-16" if begin.startswith(_UTF16) else "utf-8-sig", "replace")
        return path.suffix.lower() in (".csv", ".tsv") or _header(text.splitlines()) is not None

    @property
    def _stream(self) -> str:
        return self._path.stem

    def streams(self) -> list[LogStream]:
        """Return the stream, as of `LogReader`."""
        table = self.read([self._stream]).tables[self._stream]
        times = table.time_s[np.isfinite(table.time_s)]
        span = (float(times.min()), float(times.max())) if len(times) else (math.nan, math.nan)
        return [LogStream(self._stream, "csv", len(table.time_s), *span, note=plain(", ".join(self._names), 200))]

    def read(self, streams: Collection[str]) -> LogContent:
        """Read the table, as of `LogReader`."""
        found = LogContent()
        if self._stream not in streams:
            return found
        bad: list[int] = []
        kinds = kind_columns(self._names)
        numbers, texts = array("d"), {name: list[str]() for time in self._times for name in time}
        texts |= {name: list[str]() for name in kinds}
        where = {self._names.index(name): column for name, column in texts.items()}
        for row in self._rows(bad):
            numbers.extend(map(self._number, row))
            for i, column in where.items():
                column.append(row[i])
        rows = np.array(numbers).reshape(-1, len(self._names))
        if len(bad) > len(rows):
            raise LogError(
                f"{self._path}: {len(bad):,} of {len(bad) + len(rows):,} lines have not the {len(self._names)} columns "
                f"that are named (line {bad[0]}); give decimal points, or semicolons between the columns"
            )
        if bad:
            shown = ", ".join(map(str, bad[:3]))
            found.problems.append(f"{self._path.name}: {len(bad):,} lines are no rows of the table (line {shown}…)")
        columns = {name: rows[:, i] for i, name in enumerate(self._names)}
        time_s, problems = first_times(self._path, self._times, texts, columns)
        found.problems += problems
        for name in kinds:
            if (kind := kinds_of(name, texts[name], columns[name])) is not None:
                columns[name] = kind
                columns.setdefault(FIX_KIND, kind)
        named = with_usual_names(columns)
        if problem := mistaken_degrees(named):
            found.problems.append(f"{self._path.name}: {problem}")
        found.tables[self._stream] = LogTable(self._stream, "csv", time_s, named)
        return found

    def _rows(self, bad: list[int]) -> Iterator[list[str]]:
        with self._open() as text:
            for _ in range(self._skipped):
                text.readline(_LONGEST_LINE)
            reader = csv.reader(text, delimiter=self._delimiter)
            try:
                for row in reader:
                    if not row or row == [""] or row[0].lstrip().startswith(_COMMENTS):
                        continue
                    if len(row) == len(self._names) + 1 and not row[-1].strip():  # a separator at the end
                        row.pop()
                    if len(row) == len(self._names):
                        yield row
                    else:
                        bad.append(reader.line_num + self._skipped)
            except csv.Error as error:
                line = reader.line_num + self._skipped
                raise LogError(f"{self._path}: line {line} cannot be read ({error}); correct or delete it") from error

    def _number(self, cell: str) -> float:
        """Return the number in a cell, with a decimal comma where commas separate no columns; NaN if it is none."""
        try:
            return float(cell)
        except ValueError:
            pass
        if self._delimiter == "," and '"' not in cell and "," not in cell:
            return math.nan
        plain_cell = cell.replace(".", "") if _GROUPED.fullmatch(cell.strip()) else cell
        try:
            return float(plain_cell.replace(",", "."))
        except ValueError:
            return math.nan

    def _open(self) -> TextIO:
        return self._path.open(encoding=self._encoding, errors="replace", newline="")


def _lines(text: TextIO) -> Iterator[str]:
    """Yield the first lines."""
    return islice(iter(lambda: text.readline(_LONGEST_LINE), ""), _SEARCHED_LINES)


def _header(lines: list[str]) -> tuple[int, str, list[str], list[list[str]]] | None:
    """Find the line of names: lines up to its end, separator, names, and choices of time columns; None without one.

    Comments before it are skipped, but it may be one itself.
    """
    for number, line in enumerate(lines, 1):
        delimiter = max(_SEPARATORS, key=line.count)
        if delimiter not in line:
            continue
        bare = re.sub(r"^\s*(#|%|//)+", "", line.rstrip("\r\n")).rstrip()
        names = [name.strip() for name in next(csv.reader([bare], delimiter=delimiter), [])]
        if names and not names[-1]:
            names.pop()
        if len(names) > 1 and (times := time_columns(names)):
            return number, delimiter, [name or f"column {i}" for i, name in enumerate(names, 1)], times
        if not line.lstrip().startswith(_COMMENTS):
            return None
    return None
