"""Tracks of GPX files: what watches, phones and hand-held receivers record."""

from __future__ import annotations

import math
from array import array
from collections.abc import Collection
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from xml.parsers import expat

import numpy as np

from touchline.recordings.logs.foreign_sensors import FIXED, FLOAT, NONE, SINGLE
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream, LogTable
from touchline.schemas.plain_text import plain

_COLUMNS: Final = ("time_s", "latitude_deg", "longitude_deg", "altitude_m", "fix", "satellites", "hdop", "age_s")
_TEXTS: Final = {"ele": "altitude_m", "sat": "satellites", "hdop": "hdop", "ageofdgpsdata": "age_s"}
_FIXES: Final = {"none": NONE, "2d": SINGLE, "3d": SINGLE, "dgps": SINGLE, "pps": SINGLE, "rtk": FIXED, "float": FLOAT}
_BLOCK_BYTES: Final = 1 << 16
_DEEPEST: Final = 64
_LONGEST_TEXT: Final = 200


class GpxLog:
    """Reader of one file: one stream, ``track``: the points of all tracks in the order of the file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._content: LogContent | None = None

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Return whether it has the root element of GPX, or its ending."""
        return b"<gpx" in begin or (
            path.suffix.lower() == ".gpx" and begin.lstrip(b"\xef\xbb\xbf \r\n").startswith(b"<")
        )

    def streams(self) -> list[LogStream]:
        """Return the stream, as of `LogReader`."""
        table = self._read().tables["track"]
        times = table.time_s[np.isfinite(table.time_s)]
        span = (float(times.min()), float(times.max())) if len(times) else (math.nan, math.nan)
        return [LogStream("track", table.kind, len(table.time_s), *span)]

    def read(self, streams: Collection[str]) -> LogContent:
        """Read the track, as of `LogReader`."""
        return self._read() if "track" in streams else LogContent()

    def _read(self) -> LogContent:
        if self._content is None:
            points = _Points()
            problems = points.feed(self._path)
            rows = np.array(points.rows).reshape(-1, len(_COLUMNS))
            if not len(rows):
                raise LogError(f"{self._path}: has no track point{problems and f' ({problems})'}; export a track (trk)")
            columns = {name: rows[:, i] for i, name in enumerate(_COLUMNS)}
            if not np.isfinite(columns["time_s"]).any():
                raise LogError(f"{self._path}: its {len(rows):,} track points have no time; export the recorded track")
            table = LogTable("track", "gpx", columns.pop("time_s"), columns)
            notes = [f"{self._path.name}: the rest cannot be read: {problems}"] if problems else []
            self._content = LogContent({"track": table}, notes)
        return self._content


class _Points:
    """Collector of track points from the parser's events."""

    def __init__(self) -> None:
        self.rows = array("d")
        self._point: dict[str, float] | None = None
        self._deep = 0
        self._text = ""
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._add
        self._parser.StartDoctypeDeclHandler = self._refuse

    def feed(self, path: Path) -> str:
        """Read a file; return why reading ended early, empty if it did not."""
        try:
            with path.open("rb") as stream:
                while block := stream.read(_BLOCK_BYTES):
                    self._parser.Parse(block, False)
            self._parser.Parse(b"", True)
        except (expat.ExpatError, ValueError) as error:
            return plain(str(error), 200)
        return ""

    def _refuse(self, *_declared: object) -> None:
        raise ValueError("it declares a document type, which GPX has none of")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._deep, self._text = self._deep + 1, ""
        if self._deep > _DEEPEST:
            raise ValueError(f"its elements are nested more than {_DEEPEST} deep")
        if _local(name) == "trkpt":
            place = _number(attributes.get("lat", "")), _number(attributes.get("lon", ""))
            self._point = {"latitude_deg": place[0], "longitude_deg": place[1]}

    def _add(self, text: str) -> None:
        if len(self._text) < _LONGEST_TEXT:
            self._text += text

    def _end(self, name: str) -> None:
        local, self._deep = _local(name), self._deep - 1
        if self._point is None:
            return
        if local == "trkpt":
            self.rows.extend(self._point.get(column, math.nan) for column in _COLUMNS)
            self._point = None
        elif local == "time":
            self._point["time_s"] = _seconds(self._text.strip())
        elif local == "fix":
            self._point["fix"] = _FIXES.get(self._text.strip().lower(), SINGLE)
        elif local in _TEXTS:
            self._point[_TEXTS[local]] = _number(self._text)


def _local(name: str) -> str:
    return name.rpartition(":")[2]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _seconds(text: str) -> float:
    """Parse seconds since 1970; NaN if it is no time. Without a zone it is UTC, as GPX demands."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return math.nan
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
