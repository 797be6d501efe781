"""ROS 1 bags, and everything of ROS 2 that recordings are read from: MCAP, SQLite bags, and folders of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader, ReaderError

from touchline.services.bridge.decoding import full_name
from touchline.services.bridge.output import RecordingError
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bridge.recorded import Damage, Recorded, RecordingKind
from touchline.services.imports.log_table import LogContent, LogError, LogStream, LogTable
from touchline.services.imports.ros_columns import RosColumns

_BAG1: Final = b"#ROSBAG V"
_MCAP: Final = b"\x89MCAP0\r\n"
_SQLITE: Final = b"SQLite format 3\0"


class RosbagLog:
    """One bag: a ROS 1 bag, an MCAP or SQLite file, or a folder of these; each topic is a stream."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._problems: list[str] = []
        self._streams: list[LogStream] | None = None

    @staticmethod
    def recognises(path: Path, begin: bytes) -> bool:
        """Whether it begins as bags do, or is a folder."""
        return path.is_dir() or begin.startswith((_BAG1, _MCAP, _SQLITE)) or path.suffix == ".bag"

    def streams(self) -> list[LogStream]:
        """See `LogReader`."""
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
        """See `LogReader`."""
        content = LogContent()
        takers: dict[str, RosColumns] = {}
        refused: dict[str, str] = {}
        damaged: Counter[str] = Counter()
        for message in self._messages(streams):
            if message.topic in refused:
                continue
            try:
                if message.topic not in takers:
                    takers[message.topic] = RosColumns(message.kind)
                takers[message.topic].take(message.payload, message.log_time_ns)
            except Damage as damage:
                if message.topic not in takers:
                    refused[message.topic] = str(damage)
                else:
                    damaged[message.topic] += 1
        for topic, taker in takers.items():
            time_s, arrived_s = taker.times()
            content.tables[topic] = LogTable(topic, taker.type, time_s, taker.columns(), arrived_s)
        content.problems += [f"{topic}: cannot be read: {why}" for topic, why in refused.items()]
        content.problems += [f"{topic}: {count:,} messages are damaged" for topic, count in damaged.items()]
        content.problems += self._problems
        return content

    def _messages(self, streams: Collection[str] | None) -> Iterator[Recorded]:
        """The messages of some topics, or of all.

        Raises:
            LogError: The bag cannot be read.
        """
        self._problems = []
        if not self._path.is_dir() and self._path.suffix == ".bag":
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
        try:
            with Reader(self._path) as reader:
                kinds = {}
                for connection in reader.connections:
                    told = connection.msgdef.data if connection.msgdef.format == MessageDefinitionFormat.MSG else ""
                    kinds[connection.id] = RecordingKind("ros1", connection.msgtype, "ros1msg", told)
                wanted = [each for each in reader.connections if streams is None or each.topic in streams]
                if not wanted:
                    return
                for connection, time_ns, raw in reader.messages(wanted):
                    yield Recorded(connection.topic, time_ns, time_ns, 0, bytes(raw), kinds[connection.id])
        except ReaderError as error:
            told = str(error).rstrip(".")
            remedy = (
                "`rosbag reindex` mends a bag that was broken off" if "index" in told.lower() else "give a whole bag"
            )
            raise LogError(f"{self._path}: cannot be read as a ROS 1 bag ({told}); {remedy}") from error
        except (OSError, EOFError, ValueError, KeyError, AssertionError, IndexError) as error:
            what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            raise LogError(f"{self._path}: cannot be read as a ROS 1 bag ({what}); give a whole bag") from error
