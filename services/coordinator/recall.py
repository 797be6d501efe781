"""Recall of all cells of a team whose coordinator is lost: robots forget theirs and brake until they have new ones.

A robot brakes on its stopping segment, which is in the cell that it has forgotten, and these are apart. So the first
new cells are made of the segments that the robots report, as if they stood there, and need not wait until they do.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Final

from touchline.bus import Bus
from touchline.services.coordinator.group_call import GroupCall
from touchline.services.coordinator.take_over import TakeOver

_AGAIN_S: Final = 0.05
"""Wall-clock time for a robot to come to rest before it is asked again."""

Begin = Callable[[Mapping[str, Bus]], GroupCall]


class Recall:
    """Recall of the cells of all robots; call `turn` in a loop.

    Robots of a coordinator that is on the bus keep theirs.

    Attributes:
        waits_for: Robots that are not guided by this coordinator yet, with the reasons.
    """

    def __init__(self, buses: Mapping[str, Bus], begin: Begin) -> None:
        """Ask all robots who guides them.

        Args:
            buses: Buses of the robots, by name.
            begin: Asks robots that nobody guides to be guided by this coordinator.
        """
        self._owners = TakeOver(buses, by_plans=False)
        self._buses, self._begin = buses, begin
        self._left: dict[str, Bus] | None = None
        self._beginning: GroupCall | None = None
        self._again_s = 0.0
        self.waits_for = self._owners.waits_for

    def turn(self) -> bool:
        """Ask, and take answers; return True once all robots are guided by this coordinator."""
        if not self._owners.turn():
            self.waits_for = self._owners.waits_for
            return False
        if self._left is None:
            self._left = {name: bus for name, bus in self._buses.items() if name not in self.stamps_s}
        self._guide(self._left, time.monotonic())
        return not self._left

    def _guide(self, left: dict[str, Bus], now_s: float) -> None:
        """Ask robots to be guided; who refuses, as it still brakes, is asked again."""
        if self._beginning is not None:
            if self._beginning.done:
                self.waits_for = self._beginning.refused
                self._left = {name: left[name] for name in self.waits_for}
                self._beginning, self._again_s = None, now_s + _AGAIN_S
        elif left and now_s >= self._again_s:
            self._beginning = self._begin(left)

    @property
    def stamps_s(self) -> dict[str, float]:
        """Time of each robot that has forgotten its cell, by its clock, from which on it reports that."""
        answers = self._owners.answers
        return {name: each.state.stamp_s for name, each in answers.items() if each.coordinator}

    @property
    def former_is_back(self) -> bool:
        """Return whether a robot obeys another coordinator, which is on the bus."""
        return self._owners.former_is_back

    @property
    def none_is_guided(self) -> bool:
        """Return whether all have said that nobody guided them when they were asked."""
        return self._owners.none_is_guided
