"""Bags of ROS 1, and all ROS 2 recordings that the recording reader knows: MCAP, SQLite bags, and folders of them."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final

import numpy as np

from touchline.recordings.decoding import full_name
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream, LogTable
from touchline.recordings.logs.ros1_bag import BAG1_MAGIC, Ros1Bag
from touchline.recordings.logs.ros_columns import RosColumns
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Damage, Recorded, RecordingKind
from touchline.recordings.recording_file import RecordingError

_BAG1: Final = BAG1_MAGIC[:9]
_MCAP: Final = b"\x89MCAP0\r\n"
_SQLITE: Final = b"SQLite format 3\0"


class RosbagLog:
    """Reader of one bag: a ROS 1 bag, an MCAP or SQLite file, or a folder of these; each topic is a stream."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._ros1 = path.suffix == ".bag" and not path.is_dir()
        if not path.is_dir():
            with path.open("rb") as stream:
                self._ros1 |= stream.read(len(_BAG1)) == _BAG1
        self._problems: list[str] = []
        self._streams: list[LogStream] | None = None

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Return whether it begins as bags do, or is a folder."""
        return path.is_dir() or begin.startswith((_BAG1, _MCAP, _SQLITE)) or path.suffix == ".bag"

    def streams(self) -> list[LogStream]:
        """Return the topics, as of `LogReader`."""
        if self._streams is None:
            counts: Counter[str] = Counter()
            spans: dict[str, tuple[int, int]] = {}
            kinds: dict[str, RecordingKind] = {}
            for message in self._messages(None):
                counts[message.topic] += 1
                first, last = spans.get(message.topic, (message.log_time_ns, message.log_time_ns))
                spans[message.topic] = min(first, message.log_time_ns), max(last, message.log_time_ns)
                kinds[message.topic] = message.kind
            self._streams = [
                LogStream(topic, full_name(kinds[topic].type), count, spans[topic][0] / 1e9, spans[topic][1] / 1e9)
                for topic, count in counts.items()
            ]
        return self._streams

    def read(self, streams: Collection[str]) -> LogContent:
        """Read the topics, as of `LogReader`."""
        content = LogContent()
        takers: dict[str, RosColumns] = {}
        refused: dict[str, str] = {}
        damaged: Counter[str] = Counter()
        places: defaultdict[str, list[int]] = defaultdict(list)
        for place, message in enumerate(self._messages(streams)):
            if message.topic in refused:
                continue
            try:
                if message.topic not in takers:
                    takers[message.topic] = RosColumns(message.kind)
                takers[message.topic].take(message.payload, message.log_time_ns)
                places[message.topic].append(place)
            except Damage as damage:
                if message.topic not in takers:
                    refused[message.topic] = str(damage)
                else:
                    damaged[message.topic] += 1
        for topic, taker in takers.items():
            placed = np.array(places[topic], dtype=np.int64)
            content.tables[topic] = LogTable(topic, taker.type, taker.times(), taker.columns(), placed)
        content.problems += [f"{topic}: cannot be read: {why}" for topic, why in refused.items()]
        content.problems += [f"{topic}: {count:,} messages are damaged" for topic, count in damaged.items()]
        content.problems += self._problems
        return content

    def _messages(self, streams: Collection[str] | None) -> Iterator[Recorded]:
        """Yield the messages of some topics, or of all.

        Raises:
            LogError: The bag cannot be read.
        """
        self._problems = []
        if self._ros1:
            yield from self._of_ros1(streams)
            return
        try:
            reader = RecordingReader(self._path)
            yield from reader.messages(streams)
        except RecordingError as error:
            raise LogError(str(error)) from error
        if reader.summary.problem:
            self._problems.append(f"{self._path.name}: {reader.summary.problem}")

    def _of_ros1(self, streams: Collection[str] | None) -> Iterator[Recorded]:
        found = 0
        try:
            with self._path.open("rb") as stream:
                bag = Ros1Bag(self._path, stream)
                for message in bag.messages(streams):
                    found += 1
                    yield message
        except (OSError, Damage) as error:
            raise LogError(f"{self._path}: cannot be read as a ROS 1 bag ({error}); give a whole bag") from error
        if bag.problem and not found:
            raise LogError(f"{self._path}: cannot be read as a ROS 1 bag ({bag.problem}); give a whole bag")
        if bag.problem:
            self._problems.append(f"{self._path.name}: the rest cannot be read: {bag.problem}")
