"""Filter of latched messages that the next part of a recording repeats at its beginning."""

from touchline.recordings.channels import topic_at
from touchline.recordings.recorded import Recorded


class LatchedRepeats:
    """Last message of each latched topic in the parts of a recording."""

    def __init__(self) -> None:
        """Start without messages."""
        self._last: dict[str, tuple[int, bytes]] = {}
        self._latched: dict[str, bool] = {}

    def is_repeat(self, message: Recorded) -> bool:
        """Return whether a message repeats the last one of its topic; remember it."""
        latched = self._latched.get(message.topic)
        if latched is None:
            topic = topic_at(message.topic)
            latched = self._latched[message.topic] = topic is not None and topic.latched
        if not latched:
            return False
        latest = message.sequence, message.payload
        before, self._last[message.topic] = self._last.get(message.topic), latest
        return before == latest
