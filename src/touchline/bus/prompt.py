"""Prompt copies: a changed state is also published by a session that no telemetry can hold up.

A copy has the number of the message itself, which follows in order with all other telemetry. Who needs only the last
state takes whichever comes first; recorders take the messages themselves.
"""

import time
from typing import Final

import zenoh

from touchline.bus import attachment

_FORGOTTEN_S: Final = 3.0
"""Time for which a copy keeps back older messages: no longer, since anybody on an open bus can forge one."""
_MOST_PUBLISHERS: Final = 256


def prompt_key(key: str) -> str:
    """Return the key of the prompt copies of a topic's messages.

    Args:
        key: Key of the topic; ``**`` takes it for the key of all topics.
    """
    return f"{key}/@prompt"


class PromptPublisher:
    """Publisher of the prompt copies of one topic; never waits: where a link is full, the copy is dropped.

    Args:
        session: Session by which nothing is sent that blocks.
        key: Key of the topic.
        publisher_id: Id of the publisher of the messages themselves.
    """

    def __init__(self, session: zenoh.Session, key: str, publisher_id: bytes) -> None:
        self._id, self._key_sum = publisher_id, attachment.checksum_of_key(key)
        self._publisher = session.declare_publisher(
            prompt_key(key),
            encoding=zenoh.Encoding("application/cdr"),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
        )

    def send(self, payload: bytes, sequence: int) -> None:
        """Publish the copy of a message in CDR with this number."""
        numbered = attachment.pack(sequence, time.time_ns(), self._id)
        self._publisher.put(payload, attachment=attachment.seal(numbered, self._key_sum, payload))


class Overtaken:
    """Messages of one topic that prompt copies have overtaken, by publisher."""

    def __init__(self) -> None:
        """Start without copies."""
        self._copies: dict[bytes, tuple[int, float]] = {}

    def note(self, publisher: bytes, sequence: int) -> None:
        """Note a copy that is handed out now."""
        self._copies.pop(publisher, None)
        if len(self._copies) >= _MOST_PUBLISHERS:
            del self._copies[next(iter(self._copies))]
        self._copies[publisher] = sequence, time.monotonic() + _FORGOTTEN_S

    def holds(self, publisher: bytes, sequence: int) -> bool:
        """Return whether a message is no news, since its copy or that of a later one has been handed out."""
        if publisher not in self._copies:
            return False
        copied, until_s = self._copies[publisher]
        if time.monotonic() > until_s:
            del self._copies[publisher]
            return False
        return sequence <= copied
