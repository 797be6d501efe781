"""Streams of a log as tables: a time for each message, and columns of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.errors import TouchlineError

Floats = NDArray[np.float64]


class LogError(TouchlineError):
    """Log that cannot be read or used; the message gives reason and remedy."""


@dataclass(frozen=True)
class LogStream:
    """Description of a log's stream.

    Attributes:
        name: A topic, a kind of sentence, or a file.
        kind: Its type: ``sensor_msgs/msg/Imu``, ``nmea/GGA``, ``csv``.
        messages: Number of messages.
        first_s, last_s: Log's clock; NaN if it has none.
        note: Remark, such as why it cannot be read.
    """

    name: str
    kind: str
    messages: int
    first_s: float = float("nan")
    last_s: float = float("nan")
    note: str = ""

    @property
    def rate_hz(self) -> float:
        """Mean rate; NaN if it has none."""
        span_s = self.last_s - self.first_s
        return (self.messages - 1) / span_s if span_s > 0.0 and self.messages > 1 else float("nan")


@dataclass(frozen=True)
class LogTable:
    """Messages of a stream.

    Attributes:
        stream: Its name.
        kind: Its type.
        time_s: (n,) stamps, log's clock; neither sorted nor free of repetitions.
        columns: (n,) each, NaN where a message has no such number.
        place: (n,) each message's number among all of the log, if other streams are in the same log.
    """

    stream: str
    kind: str
    time_s: Floats
    columns: Mapping[str, Floats]
    place: NDArray[np.int64] | None = None

    def rows(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> LogTable:
        """Return the table of some of the messages, by index or by a mask."""
        columns = {name: values[chosen] for name, values in self.columns.items()}
        place = None if self.place is None else self.place[chosen]
        return replace(self, time_s=self.time_s[chosen], columns=columns, place=place)


@dataclass
class LogContent:
    """Contents read from a log.

    Attributes:
        tables: By the stream's name.
        problems: What could not be read, a line each.
    """

    tables: dict[str, LogTable] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
