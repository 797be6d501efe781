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
#: Publishers per topic whose own word is remembered; they are not forgotten for others.
_MOST_TELLING = 64


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
        self._told: dict[bytes, int] = {}
        self._overlap: dict[bytes, int] = {}

    def __len__(self) -> int:
        """Publishers that are remembered."""
        return len(self._last)

    def missed(self, publisher: bytes, sequence: int) -> int:
        """How many messages of ``publisher`` are missing just before this one; −1 for a repeated one."""
        if self._overlap and self._is_copy(publisher, sequence):
            return -1
        last = self._last.pop(publisher, None)  # taken out and put back: the dict's order is that of hearing
        told = self._told.get(publisher, last)
        if last is None:
            self._forget_one_of_too_many()
            self._last[publisher] = sequence
            return _gap(told, sequence - 1)
        ahead = sequence - last
        if 0 < ahead <= LARGEST_GAP:
            self._last[publisher] = sequence
            return _gap(max(last, told or 0), sequence - 1)
        anew = abs(ahead) > LARGEST_GAP or (ahead < 0 and self._behind.get(publisher) == sequence - 1)
        self._last[publisher] = sequence if anew else last
        if anew:
            self._behind.pop(publisher, None)
            return 0
        self._behind[publisher] = sequence
        return -1

    def begin_again(self) -> None:
        """What has arrived may arrive once more, by another way: of each publisher all up to the last is a repeat."""
        self._overlap = dict(self._last)

    def _is_copy(self, publisher: bytes, sequence: int) -> bool:
        last = self._overlap.get(publisher)
        if last is None:
            return False
        if last - LARGEST_GAP <= sequence <= last:
            return True
        del self._overlap[publisher]
        return False

    def told(self, publisher: bytes, sequence: int) -> int:
        """``publisher`` says that this is the number of its last message, and all that has come of it is counted.

        The first word of one that was never heard says where the counting begins.

        Returns:
            How many messages are missing that were not known to be.
        """
        known = [each[publisher] for each in (self._last, self._told) if publisher in each]
        if publisher not in self._told and len(self._told) >= _MOST_TELLING:
            del self._told[next(iter(self._told))]
        self._told[publisher] = sequence
        return _gap(max(known), sequence) if known else 0

    def _forget_one_of_too_many(self) -> None:
        if len(self._last) >= MOST_PUBLISHERS:
            oldest = next(each for each in self._last if each not in self._told)
            self._behind.pop(oldest, None)
            del self._last[oldest]


def _gap(known: int | None, sequence: int) -> int:
    """Messages after the known one up to this one; none where nothing is known, or it cannot be a gap."""
    ahead = sequence - known if known is not None else 0
    return ahead if 0 < ahead <= LARGEST_GAP else 0
