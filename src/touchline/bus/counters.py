"""Message counters of one process on the bus, and detection of sequence gaps."""

from dataclasses import dataclass


@dataclass
class Counters:
    """Messages published and received, lost in transit, and rejected as unusable."""

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
#: Publishers per topic whose own reports are remembered; they are not forgotten for others.
_MOST_TELLING = 64


class SequenceGaps:
    """Counts the messages missing between those that arrived, per publisher.

    Whatever the numbers of a stranger are, even one that uses another's id, the counting returns to those of the
    publisher: after a jump that cannot be a loss it starts over, and two messages in a row from further back are
    trusted.
    """

    def __init__(self) -> None:
        """Start empty: a publisher's first message is no gap, whatever its number."""
        self._last: dict[bytes, int] = {}
        self._behind: dict[bytes, int] = {}
        self._reported: dict[bytes, int] = {}
        self._overlap: dict[bytes, int] = {}

    def __len__(self) -> int:
        """Return the number of publishers that are remembered."""
        return len(self._last)

    def missed(self, publisher: bytes, sequence: int) -> int:
        """Return how many messages of ``publisher`` are missing just before this one; −1 for a repeated one."""
        if self._overlap and self._is_copy(publisher, sequence):
            return -1
        last = self._last.pop(publisher, None)  # taken out and put back: the dict's order is that of hearing
        reported = self._reported.get(publisher, last)
        if last is None:
            self._forget_one_of_too_many()
            self._last[publisher] = sequence
            return _gap(reported, sequence - 1)
        ahead = sequence - last
        if 0 < ahead <= LARGEST_GAP:
            self._last[publisher] = sequence
            return _gap(max(last, reported or 0), sequence - 1)
        anew = abs(ahead) > LARGEST_GAP or (ahead < 0 and self._behind.get(publisher) == sequence - 1)
        self._last[publisher] = sequence if anew else last
        if anew:
            self._behind.pop(publisher, None)
            return 0
        self._behind[publisher] = sequence
        return -1

    def is_ahead(self, publisher: bytes, sequence: int) -> bool:
        """Return whether a message of this number may be still to come, as far as its publisher is known."""
        last = self._last.get(publisher)
        return last is None or 0 < sequence - last <= LARGEST_GAP

    def begin_again(self) -> None:
        """Expect repeats: what has arrived may arrive again by another path, up to the last of each publisher."""
        self._overlap = dict(self._last)

    def _is_copy(self, publisher: bytes, sequence: int) -> bool:
        last = self._overlap.get(publisher)
        if last is None:
            return False
        if last - LARGEST_GAP <= sequence <= last:
            return True
        del self._overlap[publisher]
        return False

    def take_report(self, publisher: bytes, sequence: int) -> int:
        """Take the number of the last message that ``publisher`` reports, when all that has arrived of it is counted.

        The first report of a publisher that was never heard sets the start of counting.

        Returns:
            Number of newly known missing messages.
        """
        known = [each[publisher] for each in (self._last, self._reported) if publisher in each]
        if publisher not in self._reported and len(self._reported) >= _MOST_TELLING:
            del self._reported[next(iter(self._reported))]
        self._reported[publisher] = sequence
        return _gap(max(known), sequence) if known else 0

    def _forget_one_of_too_many(self) -> None:
        if len(self._last) >= MOST_PUBLISHERS:
            oldest = next(each for each in self._last if each not in self._reported)
            self._behind.pop(oldest, None)
            del self._last[oldest]


def _gap(known: int | None, sequence: int) -> int:
    """Return the number of messages after the known one up to this one; 0 if none is known, or it cannot be a gap."""
    ahead = sequence - known if known is not None else 0
    return ahead if 0 < ahead <= LARGEST_GAP else 0
