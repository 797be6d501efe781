"""Message counters of one process on the bus, and detection of sequence gaps."""

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


#: A jump over more numbers than this is no loss: nobody can have sent so many meanwhile.
LARGEST_GAP = 1_000_000
#: Publishers remembered per topic; beyond them the one that has been silent for longest is forgotten.
MOST_PUBLISHERS = 256


class SequenceGaps:
    """Counts the messages missing between those that arrived, per publisher.

    Whatever the numbers of a stranger are, even one that uses another's id, the counting finds back to those of the
    publisher: after a jump that cannot be a loss it begins anew, and two messages in a row from further back are
    believed.
    """

    def __init__(self) -> None:
        """Nothing has been seen yet: a publisher's first message is no gap, whatever its number."""
        self._last: dict[bytes, int] = {}
        self._behind: dict[bytes, int] = {}

    def __len__(self) -> int:
        """Publishers that are remembered."""
        return len(self._last)

    def missed(self, publisher: bytes, sequence: int) -> int:
        """How many messages of ``publisher`` are missing just before this one; −1 for a repeated one."""
        last = self._last.pop(publisher, None)  # taken out and put back: the dict's order is that of hearing
        if last is None:
            if len(self._last) >= MOST_PUBLISHERS:
                self._behind.pop(oldest := next(iter(self._last)), None)
                del self._last[oldest]
            self._last[publisher] = sequence
            return 0
        ahead = sequence - last
        if 0 < ahead <= LARGEST_GAP:
            self._last[publisher] = sequence
            return ahead - 1
        anew = abs(ahead) > LARGEST_GAP or (ahead < 0 and self._behind.get(publisher) == sequence - 1)
        self._last[publisher] = sequence if anew else last
        if anew:
            self._behind.pop(publisher, None)
            return 0
        self._behind[publisher] = sequence
        return -1
