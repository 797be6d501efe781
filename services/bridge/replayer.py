"""What a recording says, and when: the plan of a replay. Sending and sleeping are the service's business."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from touchline.schemas.topics import Topic
from touchline.schemas.wellformed import Wellformed
from touchline.services.bridge.channels import schema_text, topic_at
from touchline.services.bridge.former_types import presented
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bridge.recorded import RecordingKind
from touchline.services.bridge.schema_change import schema_change

#: A log time further back than this is not a late measurement: the recorded clock began anew (a restarted robot).
RESTART_NS = 2_000_000_000
#: One further ahead than this is damage: nothing is said for so long, and nobody waits for it.
LONGEST_SILENCE_NS = 24 * 3600 * 1_000_000_000


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
        skipped: Messages passed over because their topic is not in the topic table, or they are none of its type.
        reasons: Why those of a topic in the table are none of its type, as far as it is for their schema.

    Raises:
        RecordingError: The file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.reader = RecordingReader(path)
        self.skipped = 0
        self.reasons: list[str] = []
        self._topics: dict[tuple[str, RecordingKind], tuple[Topic, Wellformed] | None] = {}

    def cues(self) -> Iterator[Cue]:
        """The cues, once.

        Raises:
            RecordingError: The file is not MCAP.
        """
        elapsed_ns, latest_ns = 0, None
        for message in map(presented, self.reader.messages()):
            known = self._topic(message.topic, message.kind)
            if known is None or known[1].problem(message.payload):
                self.skipped += 1
                continue
            if latest_ns is None or not latest_ns - RESTART_NS <= message.log_time_ns <= latest_ns + LONGEST_SILENCE_NS:
                latest_ns = message.log_time_ns
            if message.log_time_ns > latest_ns:
                elapsed_ns += message.log_time_ns - latest_ns
                latest_ns = message.log_time_ns
            yield Cue(elapsed_ns / 1e9, known[0], message.payload)

    def _topic(self, path: str, kind: RecordingKind) -> tuple[Topic, Wellformed] | None:
        if (path, kind) not in self._topics:
            topic = topic_at(path)
            sendable = topic is not None and self._sendable(path, kind, topic)
            self._topics[path, kind] = (topic, Wellformed(topic.type)) if topic and sendable else None
        return self._topics[path, kind]

    def _sendable(self, path: str, kind: RecordingKind, topic: Topic) -> bool:
        """Whether what was recorded so is what the bus has now; why not is noted."""
        now = RecordingKind("cdr", topic.type.ros_type, "ros2msg", schema_text(topic).decode())
        change = schema_change(
            replace(kind, schema=kind.schema or now.schema), now, ("the recording", "the topic table")
        )
        self.reasons += [f"{path}: {note}" for note in change.notes]
        return not change.notes
