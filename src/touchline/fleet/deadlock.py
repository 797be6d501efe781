"""The right-hand rule: who stands in front of others, its goal behind them, goes round them to the right."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.fleet.cells import BufferedCell

Floats = NDArray[np.float64]

STANDS_M: Final = 0.06
"""Who is this near to the point of its cell nearest to its goal stands there…"""
AWAY_M: Final = 0.1
"""…and who is farther than this from its goal then is stuck."""
WAY_M: Final = 0.02
"""Who can come nearer to its goal by this much than where it was stuck has way again."""
PATIENCE_UPDATES: Final = 15
"""After so many updates on its way to the right it tries again: else it may go round others that stand for ever."""


class _Stuck(NamedTuple):
    """How far from its goal a robot's cell ended where it got stuck (m), and for how many updates it has been."""

    left_m: float
    updates: int


class RightHand:
    """Whom the rule sends aside, from one update to the next.

    The target is the point of the cell nearest to the goal. Who stands at it with its goal still away goes to the
    rightmost corner of its cell as seen towards the goal, until it has way again: until its cell lets it come nearer to
    its goal, by WAY_M, than where it was stuck, or PATIENCE_UPDATES have passed.
    """

    def __init__(self) -> None:
        """Nobody is stuck."""
        self._stuck: dict[str, _Stuck] = {}

    def target(self, name: str, place: Floats, goal: Floats, cell: BufferedCell) -> Floats:
        """Where a robot should go now; to be asked once an update.

        Args:
            name: The robot's.
            place: (2,) where it is (m).
            goal: (2,) where it wants to be (m).
            cell: Where it may be.

        Returns:
            (2,) a point of the cell (m).
        """
        near = cell.nearest(goal, place)
        left_m, away_m = float(np.hypot(*(goal - near))), float(np.hypot(*(goal - place)))
        before = self._stuck.pop(name, None)
        if before is None:
            stuck = _Stuck(left_m, 0) if np.hypot(*(near - place)) < STANDS_M else None
        elif left_m < before.left_m - WAY_M or before.updates == PATIENCE_UPDATES:
            stuck = None
        else:
            stuck = _Stuck(before.left_m, before.updates + 1)
        if stuck is None or away_m <= AWAY_M or not len(cell.corners):
            return near
        self._stuck[name] = stuck
        return rightmost(cell.corners, place, goal)

    @property
    def stuck(self) -> frozenset[str]:
        """Who is being sent aside."""
        return frozenset(self._stuck)


def rightmost(corners: Floats, place: Floats, goal: Floats) -> Floats:
    """The corner farthest to the right of the line from a place to a goal elsewhere; of equals the farthest along it.

    Args:
        corners: (c, 2) m, at least one.
        place: (2,) m.
        goal: (2,) m.
    """
    ahead = (goal - place) / np.hypot(*(goal - place))
    seen = corners - place
    right, along = seen @ np.array((ahead[1], -ahead[0])), seen @ ahead
    best: Floats = corners[max(range(len(corners)), key=lambda k: (round(right[k], 9), along[k]))]
    return best
