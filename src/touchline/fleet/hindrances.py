"""Why a robot of a team is not at its goal, as far as the coordinator knows."""

from typing import Final

import numpy as np

from touchline.fleet.coordination import Coordination
from touchline.fleet.tasks import GoalLists

LATELY_S: Final = 30.0
"""Who has been sent round others so lately is still looking for a way: it tries again and again."""


class Hindrances:
    """See the module; times are of the coordinator's clock.

    Args:
        coordination: Of the team.
    """

    def __init__(self, coordination: Coordination) -> None:
        self._coordination = coordination
        self._now_s = 0.0
        self._stuck_s: dict[str, float] = {}

    def update(self, now_s: float) -> None:
        """To be told of every update."""
        self._now_s = now_s
        if (hub := self._coordination.hub) is not None:
            self._stuck_s |= dict.fromkeys(hub.stuck, now_s)

    def of(self, name: str) -> str:
        """What is in a robot's way; empty if nothing is known."""
        hub, task = self._coordination.hub, self._coordination.task
        if hub is None or not isinstance(task, GoalLists):
            return ""
        if name in hub.resting:
            return "it is not heard"
        if name in task.last and (taken := hub.taken_by(np.array(task.last[name]))):
            return f"{taken}, which is not heard, may stand at its goal"
        lately = name in self._stuck_s and self._now_s - self._stuck_s[name] < LATELY_S
        return "it is sent round others, and has found no way yet" if lately else ""
