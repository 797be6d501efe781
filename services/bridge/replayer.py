"""Timeline of a replay: which message is due when. Sending and sleeping are up to `replay_service`."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from touchline.schemas.topics import Topic
from touchline.schemas.wellformed import Wellformed
from touchline.services.bridge.channels import is_drawn, namespace_at, robots_among, schema_text, topic_at
from touchline.services.bridge.former_types import presented
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bridge.recorded import RecordingKind
from touchline.services.bridge.schema_change import schema_change

#: A log time further back than this is not a late measurement: the recorded clock began anew (a restarted robot).
RESTART_NS = 2_000_000_000
#: One further ahead than this is damage: nothing is said for so long, and nobody waits for it.
LONGEST_SILENCE_NS = 24 * 3600 * 1_000_000_000
#: A robot further behind the others than this was not driving while they were.
APART_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Cue:
    """One message of a robot to send, ``at_s`` seconds after the first one; never less than that of the cue before."""

    at_s: float
    namespace: str
    topic: Topic
    payload: bytes


class _RobotTime:
    """How far the replay of one robot is, on a time that all robots of the recording share."""

    def __init__(self) -> None:
        self._latest_ns: int | None = None
        self._elapsed_ns = 0

    def at_ns(self, log_time_ns: int, shared_ns: int) -> int:
        """When a message of this log time is due, ``shared_ns`` being the time of the one before it, of any robot.

        A robot whose clock stood while others went on joins them where they are: its messages were recorded after
        theirs.
        """
        latest_ns = self._latest_ns
        if latest_ns is None or not latest_ns - RESTART_NS <= log_time_ns <= latest_ns + LONGEST_SILENCE_NS:
            latest_ns = log_time_ns
        self._elapsed_ns += max(log_time_ns - latest_ns, 0)
        self._latest_ns = max(latest_ns, log_time_ns)
        if self._elapsed_ns < shared_ns - APART_NS:
            self._elapsed_ns = shared_ns
        return max(self._elapsed_ns, shared_ns)


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
        skipped: Messages passed over because their topic is not in the topic table, or they are none of its type.
        reasons: Why those of a topic in the table are none of its type, as far as it is for their schema.

    Raises:
        RecordingError: The file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.reader = RecordingReader(path)
        self.skipped = 0
        self.reasons: list[str] = []
        self._topics: dict[tuple[str, RecordingKind], tuple[str, Topic, Wellformed] | None] = {}

    def close(self) -> None:
        """Close the recording before its end; harmless when repeated."""
        self.reader.close()

    def cues(self) -> Iterator[Cue]:
        """The cues, once.

        Raises:
            RecordingError: The file is not MCAP.
        """
        times: dict[str, _RobotTime] = {}
        at_ns = 0
        for message in map(presented, self.reader.messages()):
            known = self._topic(message.topic, message.kind)
            if known is None and is_drawn(message.topic, robots_among(self.reader.summary.topics)):
                continue  # the bridge makes it anew for who looks at the replay
            if known is None or known[2].problem(message.payload):
                self.skipped += 1
                continue
            namespace, topic, _ = known
            if namespace not in times:
                times[namespace] = _RobotTime()
            at_ns = times[namespace].at_ns(message.log_time_ns, at_ns)
            yield Cue(at_ns / 1e9, namespace, topic, message.payload)

    def _topic(self, path: str, kind: RecordingKind) -> tuple[str, Topic, Wellformed] | None:
        if (path, kind) not in self._topics:
            topic = topic_at(path)
            sendable = topic is not None and self._sendable(path, kind, topic)
            known = (namespace_at(path), topic, Wellformed(topic.type)) if topic and sendable else None
            self._topics[path, kind] = known
        return self._topics[path, kind]

    def _sendable(self, path: str, kind: RecordingKind, topic: Topic) -> bool:
        """Whether what was recorded so is what the bus has now; why not is noted."""
        now = RecordingKind("cdr", topic.type.ros_type, "ros2msg", schema_text(topic).decode())
        change = schema_change(
            replace(kind, schema=kind.schema or now.schema), now, ("the recording", "the topic table")
        )
        self.reasons += [f"{path}: {note}" for note in change.notes]
        return not change.notes
