"""Lease of a passage in which there is room for one robot: one direction at a time, and who enters can leave.

Robots of one direction go through as a *batch*. It is closed to further ones when those of the other direction have
waited for a while; then, when all have left, it is their turn. A robot enters only if a place behind the exit is free
for it, so nobody waits inside, and no circle of robots that wait for each other leads through a passage.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

_BATCH_S: Final = 10.0
"""Waiting time of the other direction after which nobody else joins a batch."""


class Lease:
    """Lease of a passage.

    Attributes:
        holders: Robots that may be inside.
    """

    def __init__(self) -> None:
        self.holders = set[int]()
        self._direction = 0
        self._since_s: dict[int, float] = {}

    def update(self, now_s: float, before_m: Mapping[int, tuple[int, float]], room: tuple[int, int]) -> None:
        """Take the lease from those that have left, and give it to those that may enter.

        Args:
            now_s: Time.
            before_m: Robots that are on the way through: direction, 0 or 1, and way to the mouth (m).
            room: Free places behind the exit in each direction.
        """
        self.holders &= before_m.keys()
        self._since_s = {robot: self._since_s.get(robot, now_s) for robot in before_m.keys() - self.holders}
        if not self.holders and self._since_s:
            first = min(self._since_s, key=lambda robot: (self._since_s[robot], before_m[robot][1], robot))
            self._direction = before_m[first][0]
        others = [since_s for robot, since_s in self._since_s.items() if before_m[robot][0] != self._direction]
        closed = bool(self.holders) and now_s - min(others, default=now_s) > _BATCH_S
        for robot in sorted(self._since_s, key=lambda robot: before_m[robot][1]):
            inside = before_m[robot][1] < 0.0
            enters = before_m[robot][0] == self._direction and len(self.holders) < room[self._direction] and not closed
            if inside or enters:
                self.holders.add(robot)
        for robot in self.holders:
            self._since_s.pop(robot, None)
