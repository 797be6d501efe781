"""What a recording says, and when: the plan of a replay. Sending and sleeping are the service's business."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from schemas.topics import Topic
from services.bridge.channels import topic_at
from services.bridge.reader import RecordingReader

#: A log time further back than this is not a late measurement: the recorded clock began anew (a restarted robot).
RESTART_NS = 2_000_000_000


@dataclass(frozen=True, slots=True)
class Cue:
    """One message to send, ``at_s`` seconds of sim time after the first; never less than that of the cue before."""

    at_s: float
    topic: Topic
    payload: bytes


class Timeline:
    """The cues of one recording, in the order in which they were recorded.

    That order is kept even where log times step back (a position fix carries the time of its measurement, 0.1 s ago):
    a receiver gets what the recorder got, as the recorder got it. The time runs by the latest log time so far.

    Args:
        path: Recording, whole or broken off.

    Attributes:
        reader: Tells how far it has been read and, at the end, what the recording held.
        skipped: Messages passed over because their topic is not in the topic table.

    Raises:
        RecordingError: The file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.reader = RecordingReader(path)
        self.skipped = 0
        self._topics: dict[str, Topic | None] = {}

    def cues(self) -> Iterator[Cue]:
        """The cues, once.

        Raises:
            RecordingError: The file is not MCAP.
        """
        elapsed_ns, latest_ns = 0, None
        for message in self.reader.messages():
            topic = self._topic(message.topic)
            if topic is None:
                self.skipped += 1
                continue
            if latest_ns is None or message.log_time_ns < latest_ns - RESTART_NS:
                latest_ns = message.log_time_ns
            if message.log_time_ns > latest_ns:
                elapsed_ns += message.log_time_ns - latest_ns
                latest_ns = message.log_time_ns
            yield Cue(elapsed_ns / 1e9, topic, message.payload)

    def _topic(self, path: str) -> Topic | None:
        if path not in self._topics:
            self._topics[path] = topic_at(path)
        return self._topics[path]
