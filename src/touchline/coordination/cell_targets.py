"""Targets of robots within their cells: the task's goals, as near as the cells allow, by the right-hand rule."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import BufferedCell
from touchline.coordination.deadlock import RightHand
from touchline.coordination.tasks import TeamTask

Floats = NDArray[np.float64]


class CellTargets:
    """Chooses targets update by update, with the state of the right-hand rule.

    Attributes:
        goals: Goal of each robot at the last update, by its name (m, map frame).
    """

    def __init__(self, task: TeamTask) -> None:
        """Choose targets for a task."""
        self._task, self._rule = task, RightHand()
        self.goals: dict[str, tuple[float, float]] = {}

    def targets(
        self, names: Sequence[str], places: Floats, cells: Sequence[BufferedCell]
    ) -> dict[str, tuple[float, float]]:
        """Return each robot's target by its name (m, map frame); to be called once per update.

        Args:
            names: Names of n robots, in alphabetical order.
            places: (n, 2) places of the robots (m, map frame).
            cells: Cell of each.
        """
        goals = self._task.goals(names, places)
        self.goals = {name: (float(x), float(y)) for name, (x, y) in zip(names, goals, strict=True)}
        found = {}
        for name, place, goal, cell in zip(names, places, goals, cells, strict=True):
            x, y = self._rule.target(name, place, goal, cell).tolist()
            found[name] = (x, y)
        return found

    @property
    def stuck(self) -> frozenset[str]:
        """Robots that the rule sends aside."""
        return self._rule.stuck
