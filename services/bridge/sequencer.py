"""Brings the messages of many topics back into the order in which they were sent.

Each topic waits in a channel of its own, and the channels are emptied one after another, so a batch is out of order,
and what is emptied last may be younger than messages that came meanwhile to a channel emptied before. But messages of
one process arrive in the order in which it sent them. So once a further batch has been taken, everything sent before
any message of the batch before has been seen: a batch is held for one round and then released in order.
"""

from collections.abc import Sequence
from operator import attrgetter
from typing import Protocol

from schemas.topics import Topic


class Arrived(Protocol):
    """What the bridge needs to know of a message; the bus's samples have it."""

    @property
    def topic(self) -> Topic:
        """Its row of the topic table."""

    @property
    def payload(self) -> bytes:
        """CDR bytes."""

    @property
    def sequence(self) -> int:
        """The publisher's count."""

    @property
    def source_time_ns(self) -> int:
        """When it was sent."""

    @property
    def missed(self) -> int:
        """Messages of its publisher that are missing just before it."""


_SENT = attrgetter("source_time_ns")


class Sequencer:
    """Sorts batches of messages by the time they were sent."""

    def __init__(self) -> None:
        """Nothing is held."""
        self._held: list[Arrived] = []

    def take(self, batch: Sequence[Arrived]) -> list[Arrived]:
        """Add a batch, which may be empty.

        Returns:
            Every message sent no later than the youngest of the batch before, in the order of sending.
        """
        if not self._held:
            self._held = sorted(batch, key=_SENT)
            return []
        youngest_ns = self._held[-1].source_time_ns
        arrived = sorted([*self._held, *batch], key=_SENT)
        certain = len(arrived)
        while arrived[certain - 1].source_time_ns > youngest_ns:
            certain -= 1
        self._held = arrived[certain:]
        return arrived[:certain]

    def rest(self) -> list[Arrived]:
        """What is still held, when nothing more is to come."""
        rest, self._held = self._held, []
        return rest
