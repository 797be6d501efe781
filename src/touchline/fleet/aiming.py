"""Targets within cells: the task's goals, as near as the cells let, by the right-hand rule."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.fleet.cells import BufferedCell
from touchline.fleet.deadlock import RightHand
from touchline.fleet.tasks import TeamTask

Floats = NDArray[np.float64]


class Aiming:
    """From update to update, whom the right-hand rule sends aside.

    Attributes:
        goals: Where each robot wanted to be at the last update, by its name (m).
    """

    def __init__(self, task: TeamTask) -> None:
        """For a task."""
        self._task, self._rule = task, RightHand()
        self.goals: dict[str, tuple[float, float]] = {}

    def targets(
        self, names: Sequence[str], places: Floats, cells: Sequence[BufferedCell]
    ) -> dict[str, tuple[float, float]]:
        """Where each robot should go, by its name (m); to be asked once an update.

        Args:
            names: Of n robots, in alphabetical order.
            places: (n, 2) where they are (m).
            cells: Where each may be.
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
        """Whom the rule sends aside."""
        return self._rule.stuck
