"""Host of the robots of one process: they take turns in one loop."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Final

from touchline.services.robot_sim.pace import LONGEST_SLICE_S
from touchline.services.robot_sim.robot_process import ROBOTS_A_TICK, Beside, RobotProcess
from touchline.services.robot_sim.telemetry import MOST_TICKS

SHORTEST_SLICE_S: Final = 0.002
"""Shortest slice: of many robots that lag behind each catches up a stretch at a time, because starting one takes a
while."""
STRIDES: Final = tuple(ticks for ticks in range(1, MOST_TICKS + 1) if MOST_TICKS % ticks == 0)
"""Possible numbers of ticks that are run at a time: divisors of the ticks that can be published at once."""


class RobotHost:
    """Robots of one process in one loop; call `turn` in a loop."""

    def __init__(self, robots: Sequence[RobotProcess]) -> None:
        """Make the robots take turns from now on."""
        self._robots = robots
        self._due_s = [0.0] * len(robots)
        self._slice_s = max(LONGEST_SLICE_S / len(robots), SHORTEST_SLICE_S)
        self._beside = Beside(robots)
        stride = next((each for each in STRIDES if each * ROBOTS_A_TICK >= len(robots)), STRIDES[-1])
        for robot in robots:
            robot.beside = self._beside
            robot.take_ticks(stride)

    def turn(self) -> None:
        """Turn each robot that has something due, and sleep until the next is due; stops are always due."""
        now_s = time.monotonic()
        for robot in self._beside.due(now_s):
            robot.answer_stops()
        for number, due_s in enumerate(self._due_s):
            if due_s <= now_s:
                self._due_s[number] = self._robots[number].step(self._slice_s)
        time.sleep(max(0.0, min(self._beside.at_s, *self._due_s) - time.monotonic()))

    def close(self) -> None:
        """End all runs in good order."""
        for robot in self._robots:
            robot.close()
