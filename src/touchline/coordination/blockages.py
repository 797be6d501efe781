"""Reasons why robots of a team are not at their goals, as far as the coordinator knows."""

from typing import Final

import numpy as np

from touchline.coordination.coordination import Coordination

LATELY_S: Final = 30.0
"""A robot sent round others within this time is still searching a path: it tries again and again."""


class Blockages:
    """Reasons by robot; times are of the coordinator's clock.

    Args:
        coordination: The team's coordinator.
    """

    def __init__(self, coordination: Coordination) -> None:
        self._coordination = coordination
        self._now_s = 0.0
        self._stuck_s: dict[str, float] = {}

    def update(self, now_s: float) -> None:
        """Take the state after an update."""
        self._now_s = now_s
        if (hub := self._coordination.hub) is not None:
            self._stuck_s |= dict.fromkeys(hub.stuck, now_s)

    def of(self, name: str) -> str:
        """Return what blocks a robot; empty if unknown."""
        hub, task = self._coordination.hub, self._coordination.task
        if hub is None or task is None or not task.ends_on_arrival:
            return ""
        if name in hub.resting:
            return "it is silent"
        if name in task.last and (taken := hub.taken_by(np.array(task.last[name]))):
            return f"{taken}, which is silent, may stand at its goal"
        lately = name in self._stuck_s and self._now_s - self._stuck_s[name] < LATELY_S
        return "it is sent round others, and has found no path yet" if lately else ""
