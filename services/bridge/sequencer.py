"""Restoration of the sending order of messages across topics.

Each topic waits in a channel of its own, and the channels are emptied one after another, so a batch is out of order,
and what is emptied last may be younger than messages that came meanwhile to a channel emptied before. But messages of
one process arrive in the order in which it sent them. So once a further batch has been taken, everything sent before
any message of the batch before has been seen: a batch is held for one round and then released in order.

The order across topics is that of the senders' wall clocks, which may be set while they send. What one publisher sent
later never comes before what it sent earlier, and after a clock was set back all go on from where they were.
"""

from collections.abc import Collection, Sequence
from operator import itemgetter
from typing import NamedTuple, Protocol

from touchline.schemas.topics import Topic

#: Publishers remembered; beyond them the one that has been silent for longest is forgotten.
_MOST_PUBLISHERS = 4096


class Arrived(Protocol):
    """Message as the bridge sees it; the bus's samples qualify."""

    @property
    def topic(self) -> Topic:
        """Row of the topic table."""

    @property
    def payload(self) -> bytes:
        """Message as CDR bytes."""

    @property
    def sequence(self) -> int:
        """Sequence number of its publisher."""

    @property
    def source_time_ns(self) -> int:
        """Time of sending by the sender's wall clock; 0 if unknown."""

    @property
    def publisher(self) -> bytes:
        """Id of the publisher; empty if unknown."""

    @property
    def missed(self) -> int:
        """Messages of its publisher that are missing just before it."""

    @property
    def namespace(self) -> str:
        """Namespace of the robot that it is about."""


class _Heard(NamedTuple):
    """Last message of a publisher: its wall time, how often clocks had been set back, and its place in time."""

    source_ns: int
    settings: int
    place_ns: int


_PLACE = itemgetter(0)


class Sequencer:
    """Sorts batches of messages of one robot by the time they were sent."""

    def __init__(self) -> None:
        """Start without messages."""
        self._held: list[tuple[int, Arrived]] = []
        self._heard: dict[tuple[str, bytes], _Heard] = {}
        self._corrections_ns = [0]
        """Offsets of wall times, after each time that a clock was set back."""
        self._latest_ns = 0

    def take(self, batch: Sequence[Arrived], cut: Collection[str] = ()) -> list[Arrived]:
        """Add a batch, which may be empty; the messages of each publisher are in its order.

        Args:
            batch: The messages.
            cut: Names of the topics of which more wait than are in the batch.

        Returns:
            Every message sent no later than the youngest of the batch before, and than the last one here of each topic
            that is cut, in the order of sending.
        """
        self._learn_of_a_setting(batch)
        placed = [(self._place_ns(message), message) for message in batch]
        if not self._held:
            self._held = sorted(placed, key=_PLACE)
            return []
        youngest_ns = self._held[-1][0]
        if cut:
            last_ns = {message.topic.name: place_ns for place_ns, message in placed}
            youngest_ns = min([youngest_ns, *(last_ns.get(key, 0) for key in cut)])
        arrived = sorted([*self._held, *placed], key=_PLACE)
        certain = len(arrived)
        while certain and arrived[certain - 1][0] > youngest_ns:
            certain -= 1
        self._held = arrived[certain:]
        return [message for _, message in arrived[:certain]]

    def rest(self) -> list[Arrived]:
        """Return the messages still held, when nothing more is to come."""
        rest, self._held = self._held, []
        return [message for _, message in rest]

    def _learn_of_a_setting(self, batch: Sequence[Arrived]) -> None:
        """Find out whether clocks were set back in a batch, and how far, by the busiest publisher."""
        settings = len(self._corrections_ns) - 1
        last = dict[tuple[str, bytes], int]()
        found: list[int] = []
        for message in batch:
            key, source_ns = (message.topic.name, message.publisher), message.source_time_ns
            if not source_ns:
                continue
            if (last_ns := last.get(key)) is None:
                heard = self._heard.get(key)
                last_ns = heard.source_ns if heard is not None and heard.settings == settings else 0
            if source_ns < last_ns:
                found.append(last_ns - source_ns)
            last[key] = source_ns
        if found:
            self._corrections_ns.append(self._corrections_ns[-1] + max(found))

    def _before_the_setting(self, source_ns: int) -> bool:
        """Return whether a publisher's first message was sent before the last setting of clocks, by the nearer time."""
        if len(self._corrections_ns) == 1:
            return False
        older_ns, newer_ns = (source_ns + correction_ns for correction_ns in self._corrections_ns[-2:])
        return self._latest_ns == 0 or abs(older_ns - self._latest_ns) < abs(newer_ns - self._latest_ns)

    def _place_ns(self, message: Arrived) -> int:
        """Return when a message was sent, by clocks that are never set back."""
        source_ns = message.source_time_ns
        if not source_ns:
            return self._latest_ns
        key = message.topic.name, message.publisher
        before = self._heard.get(key)
        settings = len(self._corrections_ns) - 1
        if before is None:
            if self._before_the_setting(source_ns):
                settings -= 1
            place_ns = source_ns + self._corrections_ns[settings]
            if len(self._heard) >= _MOST_PUBLISHERS:
                del self._heard[min(self._heard, key=lambda each: self._heard[each].place_ns)]
        else:
            if source_ns >= before.source_ns:
                settings = before.settings
            place_ns = max(source_ns + self._corrections_ns[settings], before.place_ns)
        self._heard[key] = _Heard(source_ns, settings, place_ns)
        self._latest_ns = max(self._latest_ns, place_ns)
        return place_ns
