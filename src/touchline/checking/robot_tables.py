"""Topics of one robot in a recording as tables, process by process; see `robot_messages`."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from touchline.recordings.channels import namespace_at, topic_at
from touchline.recordings.message_table import MessageTable
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded
from touchline.schemas import topics


class ProcessTables(NamedTuple):
    """Messages of one process of a robot.

    Attributes:
        tables: Tables of its topics.
        followed: Whether another process follows.
    """

    tables: Sequence[MessageTable]
    followed: bool

    def since(self, number: int) -> Self:
        """Return its messages from the one with a job's initial state on.

        Args:
            number: Number of that message among its kind, from 1; 0 for all.
        """
        if not number:
            return self
        states = [each.place for each in self.tables if topic_at(each.topic) is topics.INITIAL_STATE]
        place = np.sort(np.concatenate(states))[number - 1]
        parts = [each.rows(int(np.searchsorted(each.place, place)), len(each.place)) for each in self.tables]
        return self._replace(tables=[each for each in parts if len(each.place)])

    def of(self, names: Collection[str]) -> dict[str, MessageTable]:
        """Return the tables of these topics, as far as there are any, by name in the topic table."""
        found: dict[str, list[MessageTable]] = {}
        for table in self.tables:
            if (topic := topic_at(table.topic)) is not None and topic.name in names:
                found.setdefault(topic.name, []).append(table)
        return {name: some[0] if len(some) == 1 else MessageTable.of(_in_order(some)) for name, some in found.items()}

    def messages(self, names: Collection[str]) -> list[Recorded]:
        """Return the messages of these topics, in recorded order."""
        wanted = [each for each in self.tables if (topic := topic_at(each.topic)) is not None and topic.name in names]
        return _in_order(wanted)


class RobotTables:
    """Tables of a robot's topics in a recording.

    Args:
        path: Path of the recording.
        names: Topics, as in the topic table.
        robot: Namespace of the robot; by default the first one.

    Attributes:
        robot: Namespace of the robot.
        summary: Summary of the whole recording.

    Raises:
        RecordingError: The recording cannot be read.
    """

    def __init__(self, path: Path, names: Collection[str], robot: str | None = None) -> None:
        """Read the recording into tables."""
        self._names, self.robot = {topics.SETUP.name, topics.INITIAL_STATE.name, *names}, robot
        reader = RecordingReader(path)
        self._tables = reader.tables(self._wanted)
        self.summary = reader.summary
        setups = [each.place for each in self._tables if topic_at(each.topic) is topics.SETUP]
        self._begins = sorted(np.concatenate(setups).tolist()) if setups else []

    def process(self, number: int) -> ProcessTables:
        """Return a process's messages, from 1; all before the first setup belong to the first."""
        begin = self._begins[number - 1] if 1 < number <= len(self._begins) else 0
        if number >= len(self._begins):
            parts = [each.rows(int(np.searchsorted(each.place, begin)), len(each.place)) for each in self._tables]
        else:
            bounds = [np.searchsorted(each.place, (begin, self._begins[number])).tolist() for each in self._tables]
            parts = [each.rows(*bound) for each, bound in zip(self._tables, bounds, strict=True)]
        return ProcessTables([each for each in parts if len(each.place)], number < len(self._begins))

    def _wanted(self, path: str) -> bool:
        topic, robot = topic_at(path), namespace_at(path)
        if topic is None or topic.name not in self._names:
            return False
        if self.robot is None:
            self.robot = robot
        return robot == self.robot


def _in_order(tables: Sequence[MessageTable]) -> list[Recorded]:
    placed = [pair for each in tables for pair in zip(each.place.tolist(), each.messages(), strict=True)]
    return [message for _, message in sorted(placed, key=lambda pair: pair[0])]
