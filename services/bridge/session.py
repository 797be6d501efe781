"""A recording while it goes on."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Protocol

from touchline.services.bridge.output import RecordingError
from touchline.services.bridge.recorder import Recorder, RecordingReport
from touchline.services.bridge.sequencer import Arrived, Sequencer

#: What was recorded longer ago than this survives kill -9.
FLUSH_PERIOD_S = 0.5


class SessionInbox(Protocol):
    """Where messages wait; the bus's inbox is one."""

    @property
    def rejected(self) -> Mapping[str, int]:
        """By topic name, payloads that were no messages of their topic."""

    def drain(self) -> Sequence[Arrived]:
        """Every message that waits."""


class RecordingSession:
    """One recording while it goes on: an inbox at one end, a file at the other.

    Args:
        recorder: The file.
        inbox: Where what is recorded arrives; it is left when the session is dropped.
    """

    def __init__(self, recorder: Recorder, inbox: SessionInbox) -> None:
        self.recorder = recorder
        self._inbox = inbox
        self._sequencer = Sequencer()
        self._flush_due_s = 0.0

    @property
    def rejected(self) -> int:
        """Payloads so far that were kept from the recording because they were no messages of their topic."""
        return sum(self._inbox.rejected.values())

    def pump(self, now_s: float) -> bool:
        """Record what has arrived; returns whether anything had.

        Args:
            now_s: Any steady clock, for the time between two flushes.

        Raises:
            RecordingError: The disk is full or failed.
        """
        batch = self._inbox.drain()
        write = self.recorder.write
        for message in self._sequencer.take(batch):
            write(message.topic.name, message.payload, message.sequence, message.missed)
        if now_s >= self._flush_due_s:
            self._flush_due_s = now_s + FLUSH_PERIOD_S
            self.recorder.flush()
        return bool(batch)

    def finish(self) -> RecordingReport:
        """Record what is left and complete the file."""
        if not self.recorder.problem:
            with suppress(RecordingError):  # the report tells
                self.pump(0.0)
                for message in self._sequencer.rest():
                    self.recorder.write(message.topic.name, message.payload, message.sequence, message.missed)
        return self.recorder.finish(self._inbox.rejected)
