"""Timeline of a replay: due times of messages. Sending and sleeping are up to `replay_service`."""

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
    """Return the namespaces of the robots in a recording, from the channels before its first message.

    Raises:
        RecordingError: It cannot be opened, or is none.
    """
    with closing(RecordingReader(path)) as reader:
        next(reader.messages(), None)
        return robots_among(reader.summary.topics)


class Timeline:
    """Cues of one recording, in recorded order.

    That order is kept even where log times step back (a position fix has the time of its measurement, 0.1 s ago):
    a receiver gets what the recorder got, in the same order. Time follows the latest log time so far, for each robot
    separately.

    Args:
        path: Recording, complete or cut off.

    Attributes:
        reader: Its fraction read and, at the end, its summary.
        begin_s: Log time of the first cue, once that has been read.
        skipped: Messages skipped because their topic is not in the topic table, or they do not fit it.

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
        """Return why messages of topics in the table were skipped, as far as their schema is the reason."""
        return self._topics.reasons

    def close(self) -> None:
        """Close the recording before its end; harmless when repeated."""
        self.reader.close()

    def cues(self) -> Iterator[Cue]:
        """Yield the cues, once.

        Raises:
            RecordingError: The file is not MCAP.
        """
        times = DueTimes()
        for message in map(presented, self.reader.messages()):
            known = self._topics.find(message.topic, message.kind)
            if known is None and is_drawn(message.topic, robots_among(self.reader.summary.topics)):
                continue  # the bridge makes it anew for viewers of the replay
            if known is None or known.form.problem(message.payload):
                self.skipped += 1
                continue
            if self.begin_s is None:
                self.begin_s = message.log_time_ns / 1e9
            at_ns = times.next_ns(known.namespace, message.log_time_ns)
            yield Cue(at_ns / 1e9, known.namespace, known.topic, message.payload)


class IndexedTimeline:
    """`Timeline` for recordings with an index, from any time on.

    Attributes:
        begin_s: Log time of the first cue.
        length_s: Time of the last one.
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
        """Create that of a recording; None if it has no index, or nothing to replay."""
        index = MessageIndex.of(path)
        timeline = cls(index) if index is not None else None
        return timeline if timeline is not None and len(timeline._rows) else None

    def standing(self, at_s: float) -> HeldMessages:
        """Return the messages in force after all that is due up to then."""
        standing = HeldMessages()
        for cue in self._cues(self._telling(self._count_until(at_s))):
            standing.take(cue)
        return standing

    def after(self, at_s: float) -> Iterator[Cue]:
        """Yield the cues due later than that."""
        return self._cues(np.arange(self._count_until(at_s), len(self._rows)))

    def _count_until(self, at_s: float) -> int:
        return int(np.searchsorted(self._at_ns, at_s * 1e9 + 0.5, side="right"))

    def _telling(self, count: int) -> NDArray[np.intp]:
        """Return which of the first cues may still be in force: all of some topics, of others the last."""
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
