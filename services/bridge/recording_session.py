"""Active recording: moves messages from the inboxes to the file."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from touchline.bus.inbox import MOST_WAITING
from touchline.bus.last_sent import LastSent
from touchline.recordings.part_limits import UNLIMITED, PartLimits
from touchline.recordings.parts import next_part
from touchline.recordings.recorder import Recorder, RecordingReport, joined
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.wall_times import BEGUN, ENDED, wall_time_note
from touchline.schemas.topics import RECORDED
from touchline.services.bridge.sequencer import Arrived, Sequencer

#: Messages recorded longer ago than this survive kill -9.
FLUSH_PERIOD_S = 0.25
#: Messages of the most frequent topic, of all robots together, that are recorded before the service looks at anything
#: else: a tenth of a second's work in all. Of the others it is as many as are sent in the same time, so that a late
#: recording stays in order with few messages held.
_AT_ONCE = 512
#: Most rounds to record all that can have been waiting.
MOST_ROUNDS = MOST_WAITING


def _most_at_once(robots: int) -> dict[str, int]:
    """Return how many messages of each topic of a robot are taken at once, by its name."""
    fastest_hz = max(topic.rate_hz for topic in RECORDED)
    shares = {topic.name: (topic.rate_hz or fastest_hz) / fastest_hz for topic in RECORDED}
    return {name: math.ceil(share * max(_AT_ONCE // robots, 1)) for name, share in shares.items()}


class SessionInbox(Protocol):
    """Inbox of a robot's messages; the bus's inbox is one."""

    @property
    def namespace(self) -> str:
        """Namespace of the robot."""

    @property
    def rejected(self) -> Mapping[str, int]:
        """Number of payloads that did not fit their topic or were damaged on the way, by its name."""

    @property
    def cut(self) -> Collection[str]:
        """Names of the topics of which the last `drain` left some, or may have."""

    def drain(self, most: Mapping[str, int]) -> Sequence[Arrived]:
        """Return waiting messages, of each topic the first ones, at most as many as given by its name."""

    def take_report(self, sent: LastSent) -> int:
        """Take a publisher's report of its last message; return the number of newly known missing messages."""


class RecordingSession:
    """An active recording, from the robots' inboxes to a file.

    Args:
        recorder: The file.
        inboxes: Inboxes of recorded topics, one per robot; they are left when the session is dropped.
        limits: Limits of a part.
        continues: Files of the same recording before the recorder's.

    Attributes:
        recorder: The file that is being written.
        parts: All files of the recording.
        behind: Whether more had arrived than was recorded last.
    """

    def __init__(
        self,
        recorder: Recorder,
        inboxes: Sequence[SessionInbox],
        limits: PartLimits = UNLIMITED,
        continues: Sequence[Path] = (),
    ) -> None:
        self.recorder = recorder
        self.parts = [*continues, recorder.path]
        self._limits = limits
        self._done: list[RecordingReport] = []
        self._done_gaps = 0
        self._problem = ""
        self._inboxes = inboxes
        self._most = _most_at_once(len(inboxes))
        self._sequencers = {inbox.namespace: Sequencer() for inbox in inboxes}
        self._flush_due_s = 0.0
        self.behind = False
        recorder.note(*wall_time_note(BEGUN))

    @property
    def messages(self) -> int:
        """Number of messages in all of this session's files."""
        return self.recorder.messages + sum(report.messages for report in self._done)

    @property
    def size_bytes(self) -> int:
        """Bytes in all of this session's files so far."""
        return self.recorder.size_bytes + sum(report.bytes for report in self._done)

    @property
    def lost(self) -> int:
        """Number of messages that never arrived."""
        return self.recorder.lost + sum(report.lost for report in self._done)

    @property
    def gaps(self) -> int:
        """Number of stretches in which messages are missing."""
        return self.recorder.gaps + self._done_gaps

    @property
    def rejected(self) -> int:
        """Number of payloads kept from the recording because they did not fit their topic or were damaged."""
        return sum(self._rejected().values())

    def _rejected(self) -> dict[tuple[str, str], int]:
        """Return these by robot and topic name."""
        return {(inbox.namespace, name): n for inbox in self._inboxes for name, n in inbox.rejected.items()}

    def pump(self, now_s: float) -> bool:
        """Record what has arrived; return whether anything had.

        Args:
            now_s: Any steady clock, for the time between two flushes.

        Raises:
            RecordingError: The disk is full or failed.
        """
        busy = self._take()
        if now_s >= self._flush_due_s:
            self._flush_due_s = now_s + FLUSH_PERIOD_S
            self.recorder.flush()
        if self._limits.reached(self.recorder.size_bytes, self.recorder.span_s):
            self._begin_next_part()
        return busy

    def _begin_next_part(self) -> None:
        """End the file and continue in the next one.

        Raises:
            RecordingError: The one could not be completed, or the other cannot be created.
        """
        ended = self.recorder
        ended.note(*wall_time_note(ENDED))
        report = ended.finish(goes_on=True)
        if report.problem:
            raise RecordingError(report.problem)
        try:
            self.recorder = Recorder(
                next_part(self.parts), ended.robots, continues=self.parts, before=ended, signer=ended.signer
            )
        except RecordingError as error:
            self._problem = str(error)
            raise
        self._done.append(report)
        self._done_gaps += ended.gaps
        self.parts = [*self.parts, self.recorder.path]
        self.recorder.note(*wall_time_note(BEGUN))

    def _take(self) -> bool:
        """Record what has arrived, or a part of it: then it is `behind`. Return whether anything had."""
        busy = self.behind = False
        for inbox in self._inboxes:
            batch = inbox.drain(self._most)
            # Robots of one process have connections of their own, of which one may be slower.
            self._write(self._sequencers[inbox.namespace].take(batch, inbox.cut))
            busy, self.behind = busy or bool(batch), self.behind or bool(inbox.cut)
        return busy

    def take_reports(self, namespace: str, sent: Iterable[LastSent]) -> None:
        """Count missing messages by the publishers' own reports, once all arrived ones are recorded."""
        inboxes = [inbox for inbox in self._inboxes if inbox.namespace == namespace]
        for each in sent:
            missing = sum(inbox.take_report(each) for inbox in inboxes)
            if missing:
                self._write(self._sequencers[namespace].rest())
                self.recorder.lose(each.topic, missing, namespace)

    def finish(self, unasked: Sequence[str] = ()) -> RecordingReport:
        """Record the rest, unless it is `behind`, and complete the file.

        Args:
            unasked: Publishers whose losses are unknown.

        Returns:
            The report of all of this session's files, under the name of the first one.
        """
        if not self.recorder.problem and not self._problem:
            with suppress(RecordingError):  # the report names it
                self._take()
                for sequencer in self._sequencers.values():
                    self._write(sequencer.rest())
        if not self._problem:
            self.recorder.note(*wall_time_note(ENDED))
        last = self.recorder.finish(self._rejected(), unasked)
        return joined([*self._done, last], self._problem)

    def _write(self, messages: Iterable[Arrived]) -> None:
        write = self.recorder.write
        for message in messages:
            write(message.topic.name, message.payload, message.sequence, message.missed, message.namespace)
