"""Timeline of a replay: which message is due when. Sending and sleeping are up to `replay_service`."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.channels import is_drawn, robots_among
from touchline.recordings.former_types import present_kind, presented
from touchline.recordings.message_index import MessageIndex
from touchline.recordings.reader import RecordingReader
from touchline.recordings.replay.due_times import DueTimes, due_times_ns
from touchline.recordings.replay.held_messages import ACCUMULATING, HeldMessages
from touchline.recordings.replay.replay_cue import Cue
from touchline.recordings.sendable import SendableTopics
from touchline.schemas import topics


def recorded_robots(path: Path) -> tuple[str, ...]:
    """Namespaces of the robots in a recording, from the channels before its first message.

    Raises:
        RecordingError: It cannot be opened, or is none.
    """
    with closing(RecordingReader(path)) as reader:
        next(reader.messages(), None)
        return robots_among(reader.summary.topics)


class Timeline:
    """The cues of one recording, in the order in which they were recorded.

    That order is kept even where log times step back (a position fix carries the time of its measurement, 0.1 s ago):
    a receiver gets what the recorder got, as the recorder got it. The time runs by the latest log time so far, of each
    robot by its own.

    Args:
        path: Recording, whole or broken off.

    Attributes:
        reader: Tells how far it has been read and, at the end, what the recording held.
        begin_s: Log time of the first cue, once that has been read.
        skipped: Messages passed over because their topic is not in the topic table, or they are none of its type.

    Raises:
        RecordingError: The file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.reader = RecordingReader(path)
        self.begin_s: float | None = None
        self.skipped = 0
        self._topics = SendableTopics()

    @property
    def reasons(self) -> list[str]:
        """Why messages of topics in the table were skipped, as far as it is for their schema."""
        return self._topics.reasons

    def close(self) -> None:
        """Close the recording before its end; harmless when repeated."""
        self.reader.close()

    def cues(self) -> Iterator[Cue]:
        """The cues, once.

        Raises:
            RecordingError: The file is not MCAP.
        """
        times = DueTimes()
        for message in map(presented, self.reader.messages()):
            known = self._topics.find(message.topic, message.kind)
            if known is None and is_drawn(message.topic, robots_among(self.reader.summary.topics)):
                continue  # the bridge makes it anew for who looks at the replay
            if known is None or known.form.problem(message.payload):
                self.skipped += 1
                continue
            if self.begin_s is None:
                self.begin_s = message.log_time_ns / 1e9
            at_ns = times.next_ns(known.namespace, message.log_time_ns)
            yield Cue(at_ns / 1e9, known.namespace, known.topic, message.payload)


class IndexedTimeline:
    """As `Timeline`, for recordings with an index, from any time on.

    Attributes:
        begin_s: Log time of the first cue.
        length_s: When the last one is due.
    """

    def __init__(self, index: MessageIndex) -> None:
        self._index = index
        sendable = SendableTopics()
        self._topics = [sendable.find(path, present_kind(kind)) for path, kind in index.channels]
        known = [each is not None for each in self._topics]
        self._rows = np.flatnonzero(np.array(known, dtype=np.bool_)[index.channel])
        robots = {name: number for number, name in enumerate(sorted({each.namespace for each in self._topics if each}))}
        numbers = np.array([robots[each.namespace] if each else -1 for each in self._topics], np.int64)
        channel, log_time_ns = index.channel[self._rows], index.log_time_ns[self._rows]
        self._at_ns = due_times_ns(numbers[channel], log_time_ns)
        self._row_at_ns = np.zeros(len(index), np.int64)
        self._row_at_ns[self._rows] = self._at_ns
        self.begin_s = float(log_time_ns[0]) / 1e9 if len(log_time_ns) else 0.0
        self.length_s = float(self._at_ns[-1]) / 1e9 if len(log_time_ns) else 0.0

    @classmethod
    def of(cls, path: Path) -> "IndexedTimeline | None":
        """That of a recording; None if it has no index, or nothing to replay."""
        index = MessageIndex.of(path)
        timeline = cls(index) if index is not None else None
        return timeline if timeline is not None and len(timeline._rows) else None

    def standing(self, at_s: float) -> HeldMessages:
        """What holds after all that is due up to then."""
        standing = HeldMessages()
        for cue in self._cues(self._telling(self._count_until(at_s))):
            standing.take(cue)
        return standing

    def after(self, at_s: float) -> Iterator[Cue]:
        """What is due later than that."""
        return self._cues(np.arange(self._count_until(at_s), len(self._rows)))

    def _count_until(self, at_s: float) -> int:
        return int(np.searchsorted(self._at_ns, at_s * 1e9 + 0.5, side="right"))

    def _telling(self, count: int) -> NDArray[np.intp]:
        """Of the first so many cues those that may still hold: all of some topics, of others the last."""
        channel = self._index.channel[self._rows[:count]]
        wanted = [np.empty(0, np.intp)]
        plans = dict[str, int]()
        for number, known in enumerate(self._topics):
            if known is not None and known.topic is topics.PLAN and len(found := np.flatnonzero(channel == number)):
                plans[known.namespace] = int(found[-1])
        for number, known in enumerate(self._topics):
            if known is None:
                continue
            found = np.flatnonzero(channel == number)
            if known.topic is topics.PAINT:
                found = found[found > plans.get(known.namespace, -1)]
            wanted.append(found if known.topic in (*ACCUMULATING, topics.STATUS) else found[-1:])
        return np.sort(np.concatenate(wanted))

    def _cues(self, places: NDArray[np.intp]) -> Iterator[Cue]:
        for row, message in self._index.read(self._rows[places]):
            known = self._topics[self._index.channel[row]]
            payload = presented(message).payload
            if known is not None and not known.form.problem(payload):
                yield Cue(int(self._row_at_ns[row]) / 1e9, known.namespace, known.topic, payload)
