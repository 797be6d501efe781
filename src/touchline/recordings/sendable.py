"""Recorded messages that can be sent: those of the topic table, in the present types of the bus."""

from dataclasses import replace
from typing import NamedTuple

from touchline.recordings.channels import kind_of, namespace_at, topic_at
from touchline.recordings.recorded import RecordingKind
from touchline.recordings.schema_change import schema_change
from touchline.schemas.topics import Topic
from touchline.schemas.wellformed import Wellformed


class SendableTopic(NamedTuple):
    """Topic of messages of a recorded channel, and the check of each."""

    namespace: str
    topic: Topic
    form: Wellformed


class SendableTopics:
    """Topics of a recording whose messages can be sent.

    Attributes:
        reasons: Why messages of topics in the table cannot be sent, as far as their schema is the reason.
    """

    def __init__(self) -> None:
        self.reasons: list[str] = []
        self._known: dict[tuple[str, RecordingKind], SendableTopic | None] = {}

    def find(self, path: str, kind: RecordingKind) -> SendableTopic | None:
        """Return where messages recorded so belong; None if they cannot be sent."""
        if (path, kind) not in self._known:
            topic = topic_at(path)
            sendable = topic is not None and self._sendable(path, kind, topic)
            known = SendableTopic(namespace_at(path), topic, Wellformed(topic.type)) if topic and sendable else None
            self._known[path, kind] = known
        return self._known[path, kind]

    def _sendable(self, path: str, kind: RecordingKind, topic: Topic) -> bool:
        """Return whether the recorded kind is the present one of the bus; note why not."""
        now = kind_of(topic.type)
        change = schema_change(
            replace(kind, schema=kind.schema or now.schema), now, ("the recording", "the topic table")
        )
        self.reasons += [f"{path}: {note}" for note in change.notes]
        return not change.notes
