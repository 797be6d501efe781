"""Columns of a table of recorded messages: one for each field of the topics, named with its unit."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from touchline.recordings.decoding import layout
from touchline.recordings.message_values import at_path, flat, values_of
from touchline.recordings.recorded import Damage, Recorded, RecordingKind
from touchline.recordings.topic_selection import RecordedTopics
from touchline.recordings.units import unit_of
from touchline.schemas.errors import SpecError

#: Form of lists of messages, and of values without a schema: JSON in a text.
JSON_FORM = "json"
_ARRAY = re.compile(r"\[(\d*)\]$")
_MOST_COLUMNS = 5000


@dataclass(frozen=True)
class TableColumn:
    """One column.

    Attributes:
        path: Path of the field: ``pose.position.x``.
        form: Its type as in ROS 2 (``float64``), or `JSON_FORM`.
        listed: Whether it is a list of them, of any length.
    """

    path: str
    form: str
    listed: bool = False

    @property
    def unit(self) -> str:
        """Unit of the values; empty if there is none."""
        return unit_of(self.path)

    @property
    def name(self) -> str:
        """Name with the unit: ``pose.position.x [m]``."""
        return f"{self.path} [{self.unit}]" if self.unit else self.path


@dataclass
class TableRows:
    """Messages of some topics of a recording, as rows.

    Attributes:
        path: The recording.
        topics: Names of the topics.
        columns: Columns of all topics after the times and the topic's name; what a topic lacks is None.
        damaged: Messages that could not be decoded, and so are in no row; known when all rows have been taken.
        problem: What could not be read of the recording, known then, too.
    """

    path: Path
    topics: Sequence[str]
    columns: list[TableColumn]
    damaged: int = 0
    problem: str = ""

    def rows(self) -> Iterator[list[object]]:
        """Yield (time s, log time s, topic, then a value for each column) of each message."""
        recorded = RecordedTopics(self.path, self.topics)
        self.damaged = 0
        for message in recorded.messages():
            try:
                values = values_of(message)
            except Damage:
                self.damaged += 1
                continue
            cells = [_cell(values, column) for column in self.columns]
            yield [message.publish_time_ns / 1e9, message.log_time_ns / 1e9, message.topic, *cells]
        self.problem = recorded.summary.problem


def table_of(path: Path, topics: Sequence[str]) -> TableRows:
    """Find the columns of some topics of a recording.

    Raises:
        RecordingError: It cannot be read, or lacks one of the topics.
        SpecError: Nothing in it can be decoded, or it has too many fields.
    """
    columns: dict[str, TableColumn] = {}
    known: set[RecordingKind] = set()
    for message in RecordedTopics(path, topics).messages():
        if message.kind not in known:
            found = columns_of(message)
            if layout(message.kind) is not None:
                known.add(message.kind)
            columns.update((column.path, column) for column in found if column.path not in columns)
    if not columns:
        raise SpecError(str(path), ", ".join(topics), "has no message that can be decoded", "choose another topic")
    if len(columns) > _MOST_COLUMNS:
        raise SpecError(str(path), ", ".join(topics), f"has {len(columns):,} fields", "choose fewer topics")
    return TableRows(path, topics, list(columns.values()))


def columns_of(message: Recorded) -> list[TableColumn]:
    """Find the columns of a message's fields; none if it cannot be decoded."""
    fields = layout(message.kind)
    if fields is None:
        try:
            return [TableColumn(path, JSON_FORM) for path, _ in flat(values_of(message))]
        except Damage:
            return []
    return list(dict.fromkeys(column for path, form in fields.items() for column in _of_field(path, form)))


def _of_field(path: str, form: str) -> Iterator[TableColumn]:
    outer, bracket, _ = path.partition("[")
    many = _ARRAY.search(path)
    if not bracket:
        yield TableColumn(path, form)
    elif many is None or many.start() != len(outer):  # a list of messages
        yield TableColumn(outer, JSON_FORM)
    elif many[1]:
        yield from (TableColumn(f"{outer}[{number}]", form) for number in range(int(many[1])))
    else:
        yield TableColumn(outer, form, listed=True)


def _cell(values: object, column: TableColumn) -> object:
    found = value_in(values, column)
    return json.dumps(found) if column.form == JSON_FORM and isinstance(found, (list, dict)) else found


def value_in(values: object, column: TableColumn) -> object:
    """Return a column's value in a message; None if it has none, being of another topic or an older version."""
    try:
        return at_path(values, column.path)
    except SpecError:
        return None
