"""Which recorded messages can be sent: those of the topic table, in the types that the bus has now."""

from dataclasses import replace
from typing import NamedTuple

from touchline.recordings.channels import kind_of, namespace_at, topic_at
from touchline.recordings.recorded import RecordingKind
from touchline.recordings.schema_change import schema_change
from touchline.schemas.topics import Topic
from touchline.schemas.wellformed import Wellformed


class SendableTopic(NamedTuple):
    """Where messages of a recorded channel belong, and how each is checked."""

    namespace: str
    topic: Topic
    form: Wellformed


class SendableTopics:
    """The topics of a recording whose messages can be sent.

    Attributes:
        reasons: Why messages of topics in the table cannot be, as far as it is for their schema.
    """

    def __init__(self) -> None:
        self.reasons: list[str] = []
        self._known: dict[tuple[str, RecordingKind], SendableTopic | None] = {}

    def find(self, path: str, kind: RecordingKind) -> SendableTopic | None:
        """Of messages recorded so; None if they cannot be sent."""
        if (path, kind) not in self._known:
            topic = topic_at(path)
            sendable = topic is not None and self._sendable(path, kind, topic)
            known = SendableTopic(namespace_at(path), topic, Wellformed(topic.type)) if topic and sendable else None
            self._known[path, kind] = known
        return self._known[path, kind]

    def _sendable(self, path: str, kind: RecordingKind, topic: Topic) -> bool:
        """Whether what was recorded so is what the bus has now; why not is noted."""
        now = kind_of(topic.type)
        change = schema_change(
            replace(kind, schema=kind.schema or now.schema), now, ("the recording", "the topic table")
        )
        self.reasons += [f"{path}: {note}" for note in change.notes]
        return not change.notes
