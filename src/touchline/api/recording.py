"""`Recording`: the topics of any MCAP file or ROS 2 bag as arrays."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.api.data_frames import Kind, as_frame
from touchline.recordings.channels import robots_among
from touchline.recordings.decoding import decoder
from touchline.recordings.fixed_columns import fixed_columns
from touchline.recordings.former_types import present_kind, presented
from touchline.recordings.message_table import MessageTable
from touchline.recordings.message_values import values_of
from touchline.recordings.provenance import MADE_BY
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.recordings.recorded import Damage, Summary, TopicSummary
from touchline.recordings.table_columns import TableColumn, columns_of, value_in
from touchline.recordings.topic_selection import is_selected
from touchline.schemas.errors import SpecError
from touchline.schemas.near_names import did_you_mean

TIMES = ("time_s", "log_time_s")


@dataclass(frozen=True)
class TopicInfo:
    """One topic of a recording.

    Attributes:
        type: Name of its type, such as sensor_msgs/msg/Imu; empty if the file has none.
        messages: Number of its messages.
        rate_hz: Their mean rate; None of fewer than two.
    """

    type: str
    messages: int
    rate_hz: float | None


class Series:
    """The messages of one topic, read when they are asked for.

    Attributes:
        name: The topic, as recorded.
        info: Type, number and rate.
    """

    def __init__(self, path: Path, name: str, info: TopicInfo) -> None:
        """Read nothing yet."""
        self._path, self.name, self.info = path, name, info

    def array(self) -> NDArray[np.void]:
        """All messages as a structured array, read-only.

        Returns:
            (n,) with time_s (of the stamp), log_time_s (of recording) and a field for each field of the messages,
            named by its path (`linear_acceleration.x`; `message.time_s` if the message has such a field itself). Lists
            of one length are arrays; lists of messages are Python objects.

        Raises:
            RecordingError: The recording cannot be read.
        """
        found = [_array(table) for table in self._tables()]
        if not found:
            return np.zeros(0, [(name, np.float64) for name in TIMES])
        table = found[0] if len(found) == 1 else _stacked(found)
        table.flags.writeable = False
        return table

    def frame(self, kind: Kind = "auto") -> Any:
        """`array` as a DataFrame of pandas or polars, whichever is installed; see `kind`.

        Args:
            kind: "pandas", "polars", "numpy" or "auto".
        """
        return as_frame(self.array(), kind)

    def messages(self) -> Iterator[tuple[float, Any]]:
        """Time (s) and message, decoded by the recording's own schema, one after the other; damaged ones are left out.

        Fields are attributes (`message.linear_acceleration.x`); messages in JSON are dictionaries.
        """
        for table in self._tables():
            read = decoder(present_kind(table.kind))
            if read is None:
                continue
            for message in map(presented, table.messages()):
                with suppress(Damage):
                    yield message.publish_time_ns / 1e9, read(message.payload)

    def _tables(self) -> list[MessageTable]:
        return RecordingReader(self._path).tables(lambda topic: topic == self.name)

    def __len__(self) -> int:
        """Number of messages."""
        return self.info.messages

    def __repr__(self) -> str:
        """One line: topic, type, number and rate."""
        rate = f", {self.info.rate_hz:.4g} Hz" if self.info.rate_hz is not None else ""
        return f"Series({self.name!r}, {self.info.type}: {len(self):,} messages{rate})"


class Recording:
    """A recording: an MCAP file with its next parts, or a bag of ROS 2. Made by anybody, with the schemas in the file.

    Attributes:
        path: The file or folder.
        topics: Topics by name.
        start_s: Time of the first message.
        duration_s: Time from the first to the last message.
        made_by: Versions and platform that it was made by, if it is Touchline's own.
        robots: Namespaces of Touchline's robots in it.
        problem: What of it cannot be read, and why; empty if nothing is missing.
    """

    def __init__(self, path: str | Path, /) -> None:
        """Read what is in it.

        Args:
            path: The file or folder.

        Raises:
            RecordingError: It cannot be opened, or is no recording.
        """
        summary = read_summary(Path(path))
        self.path = Path(path)
        self.topics: Mapping[str, TopicInfo] = {name: _info(one) for name, one in sorted(summary.topics.items())}
        self.start_s, self.duration_s = _start_s(summary), summary.duration_s
        self.made_by: Mapping[str, str] = summary.metadata.get(MADE_BY, {})
        self.robots = robots_among(summary.topics)
        self.problem = summary.problem

    def __getitem__(self, topic: str) -> Series:
        """Messages of a topic: its name as recorded, or without the robot's namespace where only one has it.

        Raises:
            SpecError: There is no such topic, or several robots have it.
        """
        found = [topic] if topic in self.topics else [name for name in self.topics if is_selected(name, (topic,))]
        if len(found) != 1:
            known = found or self.topics
            guess = "" if found else did_you_mean(topic, self.topics)
            problem = f"is the topic of {len(found)} robots" if found else "is not in it"
            raise SpecError(str(self.path), topic, problem, guess or f"use one of: {', '.join(known)}")
        return Series(self.path, found[0], self.topics[found[0]])

    def frame(self, topics: list[str], /, *, on: str | None = None, kind: Kind = "auto") -> Any:
        """Several topics in one frame: to each message of one, the last one of each other topic until then.

        Args:
            topics: Topics, as in `recording[topic]`.
            on: The topic whose messages are the rows; None: the first.
            kind: As in `Series.frame`.

        Raises:
            SpecError: There is no such topic.
        """
        first = on if on is not None else topics[0]
        rows = self[first].array()
        columns: dict[str, NDArray[Any]] = {name: rows[name] for name in rows.dtype.names or ()}
        for topic in topics:
            if topic == first:
                continue
            other = self[topic].array()
            at = np.searchsorted(other["time_s"], rows["time_s"], side="right") - 1
            for name in other.dtype.names or ():
                if name not in TIMES and len(other):
                    columns[f"{topic}.{name}"] = _until(other[name], at)
        form = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
        table = np.zeros(len(rows), form)
        for name, column in columns.items():
            table[name] = column
        return as_frame(table, kind)

    def __repr__(self) -> str:
        """One line: file, messages, topics and time."""
        count = sum(topic.messages for topic in self.topics.values())
        return (
            f"Recording({self.path.name!r}: {count:,} messages of {len(self.topics)} topics, {self.duration_s:.1f} s)"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(topic.type)}</td><td>{topic.messages:,}</td></tr>"
            for name, topic in self.topics.items()
        )
        return f"<p><code>{html.escape(repr(self))}</code></p><table>{rows}</table>"


def _info(topic: TopicSummary) -> TopicInfo:
    span_s = (topic.last_ns - topic.first_ns) / 1e9
    return TopicInfo(topic.ros_type, topic.messages, (topic.messages - 1) / span_s if span_s > 0.0 else None)


def _start_s(summary: Summary) -> float:
    return min((topic.first_ns for topic in summary.topics.values() if topic.messages), default=0) / 1e9


def _array(table: MessageTable) -> NDArray[np.void]:
    """Times and fields of a table of messages."""
    columns = fixed_columns(table) if present_kind(table.kind) == table.kind else None
    if columns is None:
        return _decoded(table)
    form = [(name, np.float64, ()) for name in TIMES]
    fields = columns.dtype.names or ()
    names = _beside_times(fields)
    for name, path in zip(names, fields, strict=True):
        field = columns.dtype[path]
        text = field.kind == "S"
        form.append((name, np.dtype(f"U{max(field.itemsize, 1)}") if text else field.base, field.shape))  # type: ignore[arg-type]
    found = np.zeros(len(columns), form)
    found["time_s"], found["log_time_s"] = table.publish_time_ns / 1e9, table.log_time_ns / 1e9
    for name, path in zip(names, fields, strict=True):
        column = columns[path]
        found[name] = np.char.decode(column, "utf-8", "replace") if column.dtype.kind == "S" else column
    return found


def _decoded(table: MessageTable) -> NDArray[np.void]:
    """Times and fields of messages that are decoded one by one; damaged ones are left out."""
    times, rows = list[tuple[float, float]](), list[list[object]]()
    columns: list[TableColumn] = []
    for message in map(presented, table.messages()):
        try:
            values = values_of(message)
        except Damage:
            continue
        columns = columns or columns_of(message)
        times.append((message.publish_time_ns / 1e9, message.log_time_ns / 1e9))
        rows.append([value_in(values, column) for column in columns])
    cells = [_column(list(cells)) for cells in zip(*rows, strict=True)]
    names = _beside_times([column.path for column in columns])
    form = [(name, np.float64) for name in TIMES] + [(n, c.dtype) for n, c in zip(names, cells, strict=False)]
    found = np.zeros(len(rows), form)
    if rows:
        found["time_s"], found["log_time_s"] = np.array(times).T
        for name, column in zip(names, cells, strict=True):
            found[name] = column
    return found


def _beside_times(fields: Sequence[str]) -> list[str]:
    """Names of columns beside `TIMES` and each other; a field whose name is taken gets "message." before it."""
    names, taken = list[str](), set(TIMES)
    for field in fields:
        name = field
        while name in taken:
            name = f"message.{name}"
        names.append(name)
        taken.add(name)
    return names


def _column(cells: list[Any]) -> NDArray[Any]:
    """Cells as numbers or texts if all are of one kind; None among numbers is NaN; all else as objects."""
    kinds = {type(cell) for cell in cells}
    if kinds <= {float, int, type(None)} and kinds & {float, type(None)} and kinds != {type(None)}:
        return np.array([np.nan if cell is None else cell for cell in cells], np.float64)
    if len(kinds) == 1 and kinds <= {int, bool, str}:
        return np.array(cells)
    found = np.empty(len(cells), object)
    found[:] = cells
    return found


def _stacked(parts: list[NDArray[np.void]]) -> NDArray[np.void]:
    """Tables of one topic whose kind changed, in the order of time; fields that one lacks are left out."""
    names = [name for name in parts[0].dtype.names or () if all(name in (part.dtype.names or ()) for part in parts)]
    found = np.concatenate([part[names] for part in parts])
    return found[np.argsort(found["log_time_s"], kind="stable")]


def _until(column: NDArray[Any], at: NDArray[np.int64]) -> NDArray[Any]:
    """Values at indices; before the first (index −1) NaN, or for integers and texts the first value."""
    found = column[np.maximum(at, 0)]
    if found.dtype.kind == "f":
        found[at < 0] = np.nan
    return found
