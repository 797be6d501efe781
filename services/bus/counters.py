"""What passed through one process's end of the bus."""

from dataclasses import dataclass


@dataclass
class Counters:
    """Messages published and received, lost on the way here, and rejected as unusable."""

    published: int = 0
    received: int = 0
    lost: int = 0
    rejected: int = 0
    last_rejection: str = ""

    def reject(self, reason: str) -> None:
        """Count one unusable payload."""
        self.rejected += 1
        self.last_rejection = reason


class SequenceGaps:
    """Counts the messages missing between those that arrived, per publisher."""

    def __init__(self) -> None:
        """Nothing has been seen yet: a publisher's first message is no gap, whatever its number."""
        self._last: dict[bytes, int] = {}

    def missed(self, publisher: bytes, sequence: int) -> int:
        """How many messages of ``publisher`` are missing just before this one; −1 for a repeated one."""
        last = self._last.get(publisher, sequence - 1)
        if sequence <= last:
            return -1
        self._last[publisher] = sequence
        return sequence - last - 1
