"""Logs of GNSS receivers: NMEA sentences, UBX messages, or both with RTCM between them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.foreign_sensors import FIXED, FLOAT, NONE, SINGLE
from touchline.recordings.logs.log_table import Floats, LogContent, LogError, LogStream, LogTable
from touchline.recordings.logs.receiver_frames import NMEA, UBX, FrameCounts, frames
from touchline.recordings.logs.receiver_time import ReceiverClock
from touchline.schemas.optional_packages import require

LARGEST_BYTES: Final = 1_000_000_000
_QUALITY: Final = {0: NONE, 1: SINGLE, 2: SINGLE, 3: SINGLE, 4: FIXED, 5: FLOAT, 6: NONE, 9: SINGLE}
"""Kinds by GGA quality: none, autonomous, differential, PPS, RTK fixed, RTK float, dead reckoning; manual and simulated
are none.
"""
_MODES: Final = {"R": FIXED, "F": FLOAT, "A": SINGLE, "D": SINGLE, "P": SINGLE}
_CARRIER: Final = {0: SINGLE, 1: FLOAT, 2: FIXED}
_SAME_EPOCH_S: Final = 0.02
_SEARCHED_BYTES: Final = 65_536  # where a first frame with a checksum is searched
_FEWEST_UNCHECKED: Final = 2
_PLACE: Final = "place"  # column with a row's number in the log
Row = dict[str, float]


class ReceiverLog:
    """Reader of one file; each kind of message is a stream."""

    def __init__(self, path: Path) -> None:
        require("pyubx2", f"{path}: reading NMEA or UBX")
        import pynmeagps
        import pyubx2

        self._parse_nmea: Callable[[bytes], Any] = pynmeagps.NMEAReader.parse
        self._parse_ubx: Callable[[bytes], Any] = pyubx2.UBXReader.parse
        self._ubx_names: dict[bytes, str] = pyubx2.UBX_MSGIDS
        self._path = path
        self._content: LogContent | None = None
        self._counts: Counter[tuple[str, str]] = Counter()

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Return whether there is a frame of NMEA or UBX near the beginning."""
        return _is_checked(begin) or _sentences(begin) >= _FEWEST_UNCHECKED

    def streams(self) -> list[LogStream]:
        """Return the kinds of messages, as of `LogReader`."""
        tables = self._read().tables
        listed = []
        for (name, kind), count in sorted(self._counts.items(), key=lambda each: (-each[1], each[0])):
            times = tables[name].time_s if name in tables else np.zeros(0)
            times = times[np.isfinite(times)]
            span = (float(times.min()), float(times.max())) if len(times) else (math.nan, math.nan)
            listed.append(LogStream(name, kind, count, *span, note="" if name in tables else "has no position"))
        return listed

    def read(self, streams: Collection[str]) -> LogContent:
        """Read the messages, as of `LogReader`."""
        content = self._read()
        return LogContent({name: t for name, t in content.tables.items() if name in streams}, content.problems)

    def _read(self) -> LogContent:
        if self._content is None:
            if self._path.stat().st_size > LARGEST_BYTES:
                raise LogError(f"{self._path}: has more than {LARGEST_BYTES:,} bytes; cut it into several")
            self._content = _Messages(
                self._path, self._parse_nmea, self._parse_ubx, self._ubx_names, self._counts
            ).content()
        return self._content


def _is_checked(data: bytes) -> bool:
    """Return whether there is a frame of NMEA or UBX with a checksum."""
    return any(frame.protocol in (NMEA, UBX) for frame in frames(data, FrameCounts()))


def _sentences(data: bytes) -> int:
    """Return the number of sentences, with a checksum or without."""
    return sum(frame.protocol == NMEA for frame in frames(data, FrameCounts(), checked=False))


class _Messages:
    """Parser of all messages of a file into tables."""

    def __init__(
        self,
        path: Path,
        parse_nmea: Callable[[bytes], Any],
        parse_ubx: Callable[[bytes], Any],
        ubx_names: dict[bytes, str],
        counts: Counter[tuple[str, str]],
    ) -> None:
        self._path, self._parse_nmea, self._parse_ubx = path, parse_nmea, parse_ubx
        self._ubx_names, self._counts = ubx_names, counts
        self._clock = ReceiverClock()
        self._rows: dict[str, list[Row]] = {}
        self._undated: list[Row] = []
        self._unread = 0
        self._takers: dict[str, Callable[[Any], tuple[Row, float] | None]] = {
            "GGA": self._gga,
            "GNS": self._gns,
            "RMC": self._rmc,
            "ZDA": self._zda,
            "GST": self._gst,
            "NAV-PVT": self._pvt,
            "NAV-HPPOSLLH": self._hpposllh,
            "NAV-RELPOSNED": self._relposned,
        }

    def content(self) -> LogContent:
        """Parse the file and return its tables."""
        lost = FrameCounts()
        data = self._path.read_bytes()
        for protocol, raw in frames(data, lost, checked=_is_checked(data[:_SEARCHED_BYTES])):
            if protocol == NMEA:
                self._take_nmea(raw)
            elif protocol == UBX:
                name = self._ubx_names.get(raw[2:4], f"UBX-{raw[2]:02X}-{raw[3]:02X}")
                self._counts[name, f"ubx/{name}"] += 1
                self._take(name, self._parse_ubx, raw)
            else:
                number = int.from_bytes(raw[3:5], "big") >> 4
                self._counts[f"RTCM-{number}", "rtcm"] += 1
        for row in self._undated:
            row["time_s"] += self._clock.shift_s
        tables = {name: self._table(name, rows) for name, rows in self._rows.items()}
        _join(tables, "GGA", "GST", ("sigma_north_m", "sigma_east_m"))
        _join(tables, "NAV-PVT", "NAV-HPPOSLLH", ("latitude_deg", "longitude_deg", "altitude_m", "sigma_m"))
        tables.pop("ZDA", None)
        return LogContent(tables, self._problems(lost))

    def _problems(self, lost: FrameCounts) -> list[str]:
        name, notes = self._path.name, []
        if lost.bad_checksums:
            notes.append(f"{name}: {lost.bad_checksums:,} messages have a wrong checksum, and are left out")
        if lost.unchecked:
            notes.append(f"{name}: {lost.unchecked:,} sentences have no checksum; damage in them goes unnoticed")
        if lost.cut:
            notes.append(f"{name}: {lost.cut:,} messages are cut off by the end of the file or by damage")
        if lost.foreign_bytes:
            notes.append(f"{name}: {lost.foreign_bytes:,} bytes are of no message, and are passed over")
        if self._unread:
            notes.append(f"{name}: {self._unread:,} messages have fields that cannot be read, and are left out")
        return notes

    def _take_nmea(self, raw: bytes) -> None:
        head = raw[1:].split(b",", 1)[0].split(b"*", 1)[0].decode("ascii", "replace")
        name = head if head.startswith("P") else head[-3:]
        self._counts[name, f"nmea/{name}"] += 1
        self._take(name, self._parse_nmea, raw)

    def _take(self, name: str, parse: Callable[[bytes], Any], raw: bytes) -> None:
        if (taker := self._takers.get(name)) is None:
            return
        dated = self._clock.is_dated
        try:
            taken = taker(parse(raw))
        except Exception:  # noqa: BLE001, whatever the fields lead the parsers into
            self._unread += 1
            return
        if taken is None:
            return
        row, time_s = taken
        row["time_s"], row[_PLACE] = time_s, sum(self._counts.values())
        self._rows.setdefault(name, []).append(row)
        if not dated and not self._clock.is_dated:
            self._undated.append(row)

    @staticmethod
    def _table(name: str, rows: list[Row]) -> LogTable:
        columns = list(dict.fromkeys(column for row in rows for column in row))
        table = np.array([[row.get(column, math.nan) for column in columns] for row in rows], dtype=np.float64)
        kind = f"ubx/{name}" if "-" in name else f"nmea/{name}"
        values = {column: table[:, i] for i, column in enumerate(columns)}
        place = values.pop(_PLACE).astype(np.int64)
        return LogTable(name, kind, values.pop("time_s"), values, place)

    def _gga(self, sent: Any) -> tuple[Row, float]:
        quality = int(sent.quality or 0)
        row = _place(sent.lat, sent.lon, _sum(sent.alt, sent.sep)) if quality else {}
        row |= {
            "fix": _QUALITY.get(quality, NONE),
            "satellites": _number(sent.numSV),
            "age_s": _number(sent.diffAge),
        }
        return row | {"hdop": _number(sent.HDOP), "quality": quality}, self._clock.of_day(_second(sent.time))

    def _gns(self, sent: Any) -> tuple[Row, float]:
        fix = max((_MODES.get(mode, NONE) for mode in str(sent.posMode)), default=NONE)
        row = _place(sent.lat, sent.lon, _sum(sent.alt, sent.sep)) if fix else {}
        row |= {"fix": fix, "satellites": _number(sent.numSV), "age_s": _number(sent.diffAge)}
        return row, self._clock.of_day(_second(sent.time))

    def _rmc(self, sent: Any) -> tuple[Row, float]:
        second_s, valid = _second(sent.time), sent.status == "A"
        dated = valid and isinstance(sent.date, date)
        time_s = self._clock.dated(sent.date, second_s) if dated else self._clock.of_day(second_s)
        row = _place(sent.lat, sent.lon, math.nan) if valid else {}
        fix = _MODES.get(str(getattr(sent, "posMode", "A")), SINGLE) if valid else NONE
        course = _number(sent.cog)
        return row | {"fix": fix, "speed_mps": _number(sent.spd) * 1852.0 / 3600.0, "course_deg": course}, time_s

    def _zda(self, sent: Any) -> tuple[Row, float]:
        return {}, self._clock.dated(date(int(sent.year), int(sent.month), int(sent.day)), _second(sent.time))

    def _gst(self, sent: Any) -> tuple[Row, float]:
        row = {"sigma_north_m": _number(sent.stdLat), "sigma_east_m": _number(sent.stdLong)}
        return row, self._clock.of_day(_second(sent.time))

    def _pvt(self, sent: Any) -> tuple[Row, float]:
        utc_s = None
        if sent.validDate and sent.validTime:
            second_s = 3600.0 * sent.hour + 60.0 * sent.min + sent.second + sent.nano * 1e-9
            utc_s = ReceiverClock().dated(date(sent.year, sent.month, sent.day), second_s)
        there = bool(sent.gnssFixOk) and sent.fixType in (2, 3, 4)
        row = _place(sent.lat, sent.lon, sent.height / 1e3) if there else {}
        # The accuracy is that of the position in the plane: √2 times σ of an axis.
        row |= {
            "fix": _CARRIER.get(sent.carrSoln, SINGLE) if there else NONE,
            "sigma_m": sent.hAcc / 1e3 / math.sqrt(2),
        }
        row |= {"satellites": sent.numSV, "speed_mps": sent.gSpeed / 1e3, "course_deg": sent.headMot}
        return row, self._clock.of_week(sent.iTOW / 1e3, utc_s)

    def _hpposllh(self, sent: Any) -> tuple[Row, float]:
        row = _place(sent.lat, sent.lon, sent.height / 1e3) | {"sigma_m": sent.hAcc / 1e3 / math.sqrt(2)}
        return ({} if sent.invalidLlh else row), self._clock.of_week(sent.iTOW / 1e3)

    def _relposned(self, sent: Any) -> tuple[Row, float]:
        """Convert a position relative to a base: a moving base's second antenna, or a receiver with a base."""
        there = bool(sent.relPosValid)
        row = (
            {"east_m": sent.relPosE / 1e2, "north_m": sent.relPosN / 1e2, "up_m": -sent.relPosD / 1e2} if there else {}
        )
        row |= {"sigma_east_m": sent.accE / 1e3, "sigma_north_m": sent.accN / 1e3}
        return row | {"fix": _CARRIER.get(sent.carrSoln, SINGLE) if there else NONE}, self._clock.of_week(
            sent.iTOW / 1e3
        )


def _join(tables: dict[str, LogTable], into: str, of: str, names: tuple[str, ...]) -> None:
    """Add columns of another stream of the same epoch; the better ones take precedence."""
    if into not in tables or of not in tables:
        return
    table, other = tables[into], tables[of]
    where = _same_epoch(table, other)
    columns: dict[str, Floats] = dict(table.columns)
    for name in names:
        if name in other.columns:
            values = np.where(where >= 0, other.columns[name][where], np.nan)
            before = columns.get(name, np.full(len(table.time_s), np.nan))
            columns[name] = np.where(np.isfinite(values), values, before)
    tables[into] = replace(table, columns=columns)


def _same_epoch(table: LogTable, other: LogTable) -> NDArray[np.int64]:
    """Return (n,) rows of another stream of the same epochs, the nearest in the log; −1 where there is none."""
    assert table.place is not None
    assert other.place is not None
    order = np.argsort(other.time_s, kind="stable")
    times = other.time_s[order]
    begin = np.searchsorted(times, table.time_s - _SAME_EPOCH_S, side="left")
    end = np.searchsorted(times, table.time_s + _SAME_EPOCH_S, side="right")
    found = np.where(end > begin, order[begin.clip(0, len(order) - 1)], -1)
    for i in np.flatnonzero(end > begin + 1):  # after a clock was set back
        rows = order[begin[i] : end[i]]
        found[i] = rows[np.abs(other.place[rows] - table.place[i]).argmin()]
    return found


def _place(latitude: Any, longitude: Any, altitude: float) -> Row:
    return {"latitude_deg": _number(latitude), "longitude_deg": _number(longitude), "altitude_m": altitude}


def _sum(altitude: Any, separation: Any) -> float:
    """Return the height above the ellipsoid: above the sea, plus the geoid's."""
    geoid_m = _number(separation)
    return _number(altitude) + (0.0 if math.isnan(geoid_m) else geoid_m)


def _number(value: Any) -> float:
    """Return a field's number; NaN if it is empty."""
    return math.nan if value in ("", None) else float(value)


def _second(clock: Any) -> float:
    """Return the second of the day."""
    second_s: float = 3600.0 * clock.hour + 60.0 * clock.minute + clock.second + clock.microsecond / 1e6
    return second_s
