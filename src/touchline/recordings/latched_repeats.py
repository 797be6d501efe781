"""Tells what a recording's next part repeats: the last messages of latched topics, with which it begins."""

from touchline.recordings.channels import topic_at
from touchline.recordings.recorded import Recorded


class LatchedRepeats:
    """What the parts of a recording have said last of each latched topic."""

    def __init__(self) -> None:
        """Nothing was said."""
        self._last: dict[str, tuple[int, bytes]] = {}
        self._latched: dict[str, bool] = {}

    def said_before(self, message: Recorded) -> bool:
        """Whether it is the same message as the last one of its topic, heard again; notes it."""
        latched = self._latched.get(message.topic)
        if latched is None:
            topic = topic_at(message.topic)
            latched = self._latched[message.topic] = topic is not None and topic.latched
        if not latched:
            return False
        said = message.sequence, message.payload
        before, self._last[message.topic] = self._last.get(message.topic), said
        return before == said
