"""Messages of a topic as columns, for readers of a few numbers of many messages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.mcap_file import MESSAGE_HEAD, RECORD_HEAD_BYTES, McapFile, MessageRun
from touchline.recordings.recorded import Recorded, RecordingKind, Summary
from touchline.schemas.layout import Payloads

Integers = NDArray[np.int64]
Wanted = Callable[[str], bool]
"""Predicate on a topic as recorded: whether its messages are wanted."""
_AT_ONCE_BYTES: Final = 4_000_000
_HEAD: Final = np.dtype([("channel", "<u2"), ("sequence", "<u4"), ("log_time_ns", "<u8"), ("publish_time_ns", "<u8")])


class MessageTable(NamedTuple):
    """The n messages of a topic, in recorded order.

    Attributes:
        topic: As recorded.
        kind: Kind of all of them.
        place: (n,) number of each among all messages of the recording.
        log_time_ns: (n,)
        publish_time_ns: (n,)
        payloads: Payloads of all.
    """

    topic: str
    kind: RecordingKind
    place: Integers
    log_time_ns: Integers
    publish_time_ns: Integers
    payloads: Payloads

    @classmethod
    def of(cls, messages: Iterable[Recorded]) -> Self:
        """Create it from at least one message of one topic and kind."""
        held = list(messages)
        times = np.array([(each.log_time_ns, each.publish_time_ns) for each in held], np.int64)
        payloads = Payloads.of([each.payload for each in held])
        return cls(held[0].topic, held[0].kind, np.arange(len(held)), times[:, 0], times[:, 1], payloads)

    def rows(self, begin: int, end: int) -> Self:
        """Return rows `begin` to `end` - 1."""
        before = sum(self.payloads.sizes[:begin])
        sizes = self.payloads.sizes[begin:end]
        columns = (self.place, self.log_time_ns, self.publish_time_ns)
        place, log, publish = (column[begin:end] for column in columns)
        payloads = Payloads(sizes, self.payloads.data[before : before + sum(sizes)])
        return self._replace(place=place, log_time_ns=log, publish_time_ns=publish, payloads=payloads)

    def messages(self) -> Iterator[Recorded]:
        """Yield the messages one by one, without their sequence numbers."""
        times = self.log_time_ns.tolist(), self.publish_time_ns.tolist()
        for log_time_ns, publish_time_ns, payload in zip(*times, self.payloads.each(), strict=True):
            yield Recorded(self.topic, log_time_ns, publish_time_ns, 0, payload, self.kind)


class TableFiller:
    """Collector of messages into tables.

    Args:
        wanted: Selects the collected topics; all are counted.
    """

    def __init__(self, wanted: Wanted) -> None:
        """Start empty."""
        self._wanted = wanted
        self._parts: dict[tuple[str, RecordingKind], list[tuple[Integers, Integers, Integers, Payloads]]] = {}
        self._runs: list[MessageRun] = []
        self._held_bytes = self._messages = 0

    def fill(self, file: McapFile, summary: Summary) -> None:
        """Take all messages of a file.

        Raises:
            RecordingError: It is not MCAP.
        """
        for run in file.runs():
            if run.starts:
                self._runs.append(run)
                self._held_bytes += len(run.data)
            if not run.starts or self._held_bytes > _AT_ONCE_BYTES:
                self._take(file, summary)

    def tables(self) -> list[MessageTable]:
        """Return the collected tables."""
        found = []
        for (topic, kind), parts in self._parts.items():
            place, log, publish, payloads = zip(*parts, strict=True)
            columns = np.concatenate(place), np.concatenate(log), np.concatenate(publish)
            found.append(MessageTable(topic, kind, *columns, Payloads.joined(payloads)))
        return found

    def _take(self, file: McapFile, summary: Summary) -> None:
        """Convert the held runs to columns."""
        runs, self._runs, self._held_bytes = self._runs, [], 0
        if not runs:
            return
        before = np.repeat(np.cumsum([0, *(len(run.data) for run in runs[:-1])]), [len(run.starts) for run in runs])
        starts = np.array([at for run in runs for at in run.starts], np.int64) + before
        # Each ends where the head of the next one begins, but for the last of a run.
        last = np.cumsum([len(run.starts) for run in runs]) - 1
        ends = np.append(starts[1:], 0) - RECORD_HEAD_BYTES
        ends[last] = before[last] + [run.end for run in runs]
        data = b"".join(run.data for run in runs)
        raw = np.frombuffer(data, np.uint8)
        heads = raw[starts[:, None] + np.arange(MESSAGE_HEAD.size)].view(_HEAD)[:, 0]
        starts += MESSAGE_HEAD.size
        log = heads["log_time_ns"].astype(np.int64)
        publish = heads["publish_time_ns"].astype(np.int64)
        if not file.from_zero:
            publish = np.where(publish == 0, log, publish)
        for channel in np.unique(heads["channel"]).tolist():
            rows = np.flatnonzero(heads["channel"] == channel)
            known = file.channel_of(channel, len(rows))
            if known is None:
                continue
            begins, stops = starts[rows], ends[rows]
            sizes = (stops - begins).tolist()
            times = log[rows]
            summary.count_many(known[0], (int(times.min()), int(times.max())), len(rows), sum(sizes))
            if self._wanted(known[0]):
                wanted = b"".join([data[i:j] for i, j in zip(begins.tolist(), stops.tolist(), strict=True)])
                part = (self._messages + rows, times, publish[rows], Payloads(sizes, wanted))
                self._parts.setdefault(known, []).append(part)
        self._messages += len(starts)
