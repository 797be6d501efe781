"""Statistics of a team's task, for the report at its end."""

from __future__ import annotations

import json
import math

from touchline.coordination.algorithms.wish_figures import wish_figures
from touchline.coordination.blockages import Blockages
from touchline.coordination.coordination import Coordination
from touchline.schemas.messages import TeamReport


class TaskStatistics:
    """Accumulator of a task's statistics.

    Args:
        coordination: The team's coordinator, which has this task from now on.
        kind: Kind of the task.
    """

    def __init__(self, coordination: Coordination, kind: str) -> None:
        self._coordination, self._kind = coordination, kind
        self._blockages = Blockages(coordination)
        self._begun_s = self._now_s = math.nan
        self._nearest_m = math.inf
        self._updates = self._heard = self._sent = 0

    def count(self, heard: int, sent: int) -> None:
        """Count messages of an exchange."""
        self._heard, self._sent = self._heard + heard, self._sent + sent

    def update(self, now_s: float) -> None:
        """Take an update; those before all robots are localized do not count.

        Args:
            now_s: Sim time.
        """
        if (hub := self._coordination.hub) is None:
            return
        self._begun_s = now_s if self._updates == 0 else self._begun_s
        self._now_s, self._updates = now_s, self._updates + 1
        self._nearest_m = min(self._nearest_m, hub.nearest_m)
        self._blockages.update(now_s)

    def blockage(self, name: str) -> str:
        """Return why a robot does not reach its goal, as far as is known."""
        return self._blockages.of(name)

    def report(self, *, finished: bool) -> TeamReport | None:
        """Return the report of the task, without a header; None before its first update.

        Args:
            finished: Whether it has come to its end.
        """
        hub, task = self._coordination.hub, self._coordination.task
        if hub is None or task is None or not self._updates:
            return None
        goals = task.last
        arrived = self._coordination.arrived()
        missing = [name for name in hub.names if name in goals and name not in arrived]
        return TeamReport(
            task=self._kind,
            finished=finished,
            robots=hub.names,
            arrived=len(arrived),
            missing=tuple(
                f"{name}: {self._blockages.of(name) or 'its task ended before it arrived'}" for name in missing
            ),
            time_s=self._now_s - self._begun_s,
            nearest_m=self._nearest_m,
            updates=self._updates,
            heard=self._heard,
            told=self._sent,
            wishes_json=json.dumps(wish_figures(task, hub.interventions)),
        )
