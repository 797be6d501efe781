"""Targets of robots within their cells: the task's goals, as near as the cells allow, by the right-hand rule."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import BufferedCell
from touchline.coordination.deadlock import RightHand
from touchline.coordination.interventions import Interventions
from touchline.coordination.tasks import TeamTask

Floats = NDArray[np.float64]


class CellTargets:
    """Chooses targets update by update, with the state of the right-hand rule.

    Attributes:
        goals: Goal of each robot at the last update, by its name (m, map frame).
        interventions: Changes of velocities by cells so far.
    """

    def __init__(self, task: TeamTask, speed_towards: Callable[[float], float]) -> None:
        """Choose targets for a task.

        Args:
            task: The task.
            speed_towards: Speed (m/s) at which robots drive to a target so far away (m).
        """
        self._task, self._rule, self._speed_towards = task, RightHand(), speed_towards
        self.goals: dict[str, tuple[float, float]] = {}
        self.interventions = Interventions()

    def targets(
        self, names: Sequence[str], states: Floats, cells: Sequence[BufferedCell]
    ) -> dict[str, tuple[float, float]]:
        """Return each robot's target by its name (m, map frame); to be called once per update.

        Args:
            names: Names of n robots, in alphabetical order.
            states: (n, 4) x, y (m, map frame), heading (rad), speed (m/s) of the robots.
            cells: Cell of each.
        """
        goals, places = self._task.goals(names, states), np.ascontiguousarray(states[:, :2])
        self.goals = {name: (float(x), float(y)) for name, (x, y) in zip(names, goals, strict=True)}
        found = {}
        for name, place, goal, cell in zip(names, places, goals, cells, strict=True):
            x, y = self._rule.target(name, place, goal, cell).tolist()
            found[name] = (x, y)
        granted = np.array(list(found.values())).reshape(-1, 2)
        self.interventions.note(names, self._changes(places, goals, granted))
        return found

    def _changes(self, places: Floats, goals: Floats, targets: Floats) -> Floats:
        """Return (n, 2) change of the velocity (m/s), and 0, from places to targets instead of goals, (n, 2) m each."""
        wished, granted = (self._velocities(ends - places) for ends in (goals, targets))
        return np.column_stack((np.hypot(*(granted - wished).T), np.zeros(len(places))))

    def _velocities(self, ways: Floats) -> Floats:
        away_m = np.hypot(*ways.T)
        speeds = np.array([self._speed_towards(each) for each in away_m.tolist()])
        found: Floats = ways * np.divide(speeds, away_m, out=np.zeros_like(speeds), where=away_m > 0.0)[:, None]
        return found

    @property
    def stuck(self) -> frozenset[str]:
        """Robots that the rule sends aside."""
        return self._rule.stuck
