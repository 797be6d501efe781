"""The line to one robot of a team: what it says, and what it is told."""

from __future__ import annotations

import time
from collections.abc import Sequence

from touchline.bus import Bus
from touchline.fleet.answers import answers
from touchline.fleet.told_contacts import tick_of
from touchline.schemas import messages as m
from touchline.schemas import topics


class RobotLine:
    """See the module.

    Attributes:
        said: What it has said last.
        said_at_s: When, wall time (monotonic).
        fresh: Whether it has said something since it was asked last.
        way: Where it truly was until the last exchange in lockstep.
    """

    def __init__(self, bus: Bus, *, lockstep: bool) -> None:
        """By the robot's own bus; in lockstep it also tells the truth."""
        self._inbox = bus.inbox([topics.WHEREABOUTS, topics.TRUE_WAY][: 1 + lockstep], keep="recent")
        self._lockstep = lockstep
        self.way: m.TrueWay | None = None
        self._guidance = bus.publisher(topics.GUIDANCE, bus.publisher_id)
        self.said: m.Whereabouts | None = None
        self.said_at_s, self.fresh = time.monotonic(), False

    @property
    def tick(self) -> int:
        """Of what it has said last; −1 before."""
        return round(100 * self.said.stamp_s) if self.said is not None else -1

    def has_told(self, tick: int) -> bool:
        """Whether it has said where it is at a tick and, in lockstep, how it got there."""
        return self.tick >= tick and (not self._lockstep or (self.way is not None and tick_of(self.way) >= tick))

    def listen(self, now_s: float) -> None:
        """Take what it has said."""
        for _, message in self._inbox.messages():
            if isinstance(message, m.Whereabouts):
                self.said, self.said_at_s, self.fresh = message, now_s, True
            elif isinstance(message, m.TrueWay):
                self.way = message

    def tell(self, told: Sequence[m.Guidance], tick: int) -> None:
        """Tell it something, at least that it is answered; `tick` is that of its whereabouts."""
        for message in answers(told, tick):
            self._guidance.send(message)
