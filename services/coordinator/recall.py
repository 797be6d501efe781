"""Recall of a team by cells whose coordinator is lost: all its robots are stopped, and guided anew by this one.

A cell says nothing without those of the others, so none is taken over. A robot that is guided anew has none and stands,
and the first cells are made when all stand.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Mapping
from typing import Final

from touchline.bus import Bus
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.services.coordinator.group_call import GroupCall
from touchline.services.coordinator.take_over import TakeOver

_ANSWER_S: Final = 1.0
_AGAIN_S: Final = 0.05
"""Wall-clock time for a robot to come to rest before it is asked again."""

Begin = Callable[[Mapping[str, Bus]], GroupCall]


class Recall:
    """Recall of all robots; call `turn` in a loop.

    Robots of a coordinator that is on the bus are not recalled.

    Attributes:
        waits_for: Robots that are not guided by this coordinator yet, with the reasons.
    """

    def __init__(self, buses: Mapping[str, Bus], begin: Begin) -> None:
        """Ask all robots who guides them.

        Args:
            buses: Buses of the robots, by name.
            begin: Asks robots to be guided by this coordinator.
        """
        self._owners = TakeOver(buses, by_plans=False)
        self._left, self._begin = dict(buses), begin
        self._stopping: GroupCall | None = None
        self._beginning: GroupCall | None = None
        self._again_s = 0.0
        self.waits_for = self._owners.waits_for

    def turn(self) -> bool:
        """Ask, and take answers; return True once all robots are guided by this coordinator."""
        if not self._owners.look():
            return False
        if not self.none_is_guided:
            self._guide_anew(time.monotonic())
        return not self._left

    def _guide_anew(self, now_s: float) -> None:
        """Stop those that are left, then ask them to be guided; who still brakes refuses, and is asked again."""
        if self._beginning is not None:
            if self._beginning.done:
                self.waits_for = self._beginning.refused
                self._left = {name: self._left[name] for name in self.waits_for}
                self._beginning, self._again_s = None, now_s + _AGAIN_S
        elif self._stopping is not None:
            if self._stopping.done:
                self._stopping, self._beginning = None, self._begin(self._left)
        elif self._left and now_s >= self._again_s:
            request = m.CommandRequest(request_id=uuid.uuid4().hex)
            self._stopping = GroupCall(self._left, topics.ABORT, request, _ANSWER_S)

    @property
    def former_is_back(self) -> bool:
        """Return whether a robot obeys another coordinator, which is on the bus."""
        return self._owners.former_is_back

    @property
    def none_is_guided(self) -> bool:
        """Return whether all have said that nobody guided them when they were asked."""
        return self._owners.none_is_guided
