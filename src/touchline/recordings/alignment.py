"""Pairing of two recordings' messages by time; a message without a counterpart counts as missing."""

from collections import deque
from collections.abc import Iterator
from itertools import islice, takewhile
from typing import NamedTuple

from touchline.recordings.recorded import Recorded
from touchline.recordings.robot_time import ANEW_NS

#: Messages of a topic searched together where pairs are not obvious.
SIGHT = 32

Pair = tuple[Recorded | None, Recorded | None]


class _Placed(NamedTuple):
    """A message and the time at which it was made; ``run`` counts how often the clock was restarted before."""

    run: int
    at_ns: int
    message: Recorded


class _Side:
    """Messages of a topic read from one recording and not paired yet."""

    def __init__(self) -> None:
        self.waiting: deque[_Placed] = deque()
        self.ended = False
        self._run = 0
        self._newest_ns: int | None = None
        self._taken_ns: int | None = None

    def add(self, message: Recorded, shift_ns: int) -> None:
        at_ns = message.publish_time_ns + shift_ns
        if self._newest_ns is not None and at_ns < self._newest_ns - ANEW_NS:
            self._run += 1
            self._newest_ns = at_ns
        self._newest_ns = at_ns if self._newest_ns is None else max(self._newest_ns, at_ns)
        self.waiting.append(_Placed(self._run, at_ns, message))

    @property
    def in_sight(self) -> bool:
        """True if enough is known to pair the first message."""
        return self.ended or len(self.waiting) >= SIGHT

    def take(self) -> Recorded:
        placed = self.waiting.popleft()
        self._taken_ns = placed.at_ns
        return placed.message

    def together(self) -> list[bytes]:
        """Return payloads of the first waiting messages that have the same time."""
        when = self.waiting[0][:2]
        alike = takewhile(lambda placed: placed[:2] == when, islice(self.waiting, SIGHT))
        return [placed.message.payload for placed in alike]

    def following_ns(self) -> int | None:
        """Return the time of the second waiting message, if it belongs to the same run of the clock."""
        if len(self.waiting) < 2 or self.waiting[1].run != self.waiting[0].run:
            return None
        return self.waiting[1].at_ns

    def spacing_ns(self) -> int | None:
        """Return the time to the nearer neighbour of the first waiting message; None if it has none."""
        here_ns, following_ns = self.waiting[0].at_ns, self.following_ns()
        apart = [abs(there_ns - here_ns) for there_ns in (self._taken_ns, following_ns) if there_ns is not None]
        return min(apart, default=None)


class Alignment:
    """Pairs the messages of one topic of two recordings as they are read.

    Those made at the same time belong together; of several made at the same time, those with the same bytes; otherwise
    the nearest, up to half of the time between two messages of the topic. The work is linear in the messages.
    """

    def __init__(self) -> None:
        """Start with nothing read."""
        self._sides = (_Side(), _Side())

    def add(self, side: int, message: Recorded, shift_ns: int = 0) -> None:
        """Add a message of the first (0) or second (1) recording, with its time shifted by ``shift_ns``."""
        self._sides[side].add(message, shift_ns)

    def end(self, side: int) -> None:
        """Mark a recording as ended."""
        self._sides[side].ended = True

    def decided(self) -> Iterator[Pair]:
        """Yield pairs that are certain by now, in order; None in place of a missing counterpart."""
        left, right = self._sides
        while left.waiting and right.waiting:
            one, other = left.waiting[0], right.waiting[0]
            if one[:2] == other[:2] and one.message.payload == other.message.payload:
                yield left.take(), right.take()
            elif not (left.in_sight and right.in_sight):
                return
            elif one[:2] == other[:2]:
                yield from self._together()
            else:
                yield self._nearest()
        if left.ended:
            yield from ((None, right.take()) for _ in range(len(right.waiting)))
        if right.ended:
            yield from ((left.take(), None) for _ in range(len(left.waiting)))

    def _together(self) -> Iterator[Pair]:
        """Yield messages of the same time: up to the next two with the same bytes, or all if there are none."""
        left, right = self._sides
        ours, theirs = left.together(), right.together()
        place: dict[bytes, int] = {}
        for position, payload in enumerate(theirs):
            place.setdefault(payload, position)
        meetings = [(i, place[payload]) for i, payload in enumerate(ours) if payload in place]
        both = min(len(ours), len(theirs))
        i, j = min(meetings, key=sum, default=(both, both))
        both = min(i, j)
        yield from ((left.take(), right.take()) for _ in range(both))
        yield from ((left.take(), None) for _ in range(i - both))
        yield from ((None, right.take()) for _ in range(j - both))

    def _nearest(self) -> Pair:
        """Return the earlier of the first two messages, with the other if that is the nearest and near enough."""
        left, right = self._sides
        earlier, later = (left, right) if left.waiting[0][:2] < right.waiting[0][:2] else (right, left)
        gap_ns = later.waiting[0].at_ns - earlier.waiting[0].at_ns
        following_ns = earlier.following_ns()
        alone = earlier.waiting[0].run != later.waiting[0].run or (
            following_ns is not None and abs(following_ns - later.waiting[0].at_ns) < abs(gap_ns)
        )
        spacings = [ns for ns in (earlier.spacing_ns(), later.spacing_ns()) if ns is not None]
        if not alone and 2 * gap_ns <= max(spacings, default=2 * gap_ns):
            return left.take(), right.take()
        return (left.take(), None) if earlier is left else (None, right.take())
