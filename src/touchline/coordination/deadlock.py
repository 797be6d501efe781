"""Right-hand rule against deadlock: a robot blocked by others in front of its goal goes round them to the right."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import BufferedCell

Floats = NDArray[np.float64]

STANDS_M: Final = 0.06
"""A robot this near to the point of its cell nearest to its goal stands there…"""
AWAY_M: Final = 0.1
"""…and is stuck if it is farther than this from its goal."""
ADVANCE_M: Final = 0.02
"""A stuck robot that can come nearer to its goal by this distance is stuck no more."""
PATIENCE_UPDATES: Final = 15
"""Updates after which a robot on its way to the right tries again: else it might circle others for ever."""


class _Stuck(NamedTuple):
    """Distance from a robot's goal to the end of its cell when it got stuck (m), and the number of updates since."""

    short_m: float
    updates: int


class RightHand:
    """State of the rule, from one update to the next.

    The target is the point of the cell nearest to the goal. A robot that stands at it with its goal still away goes to
    the rightmost corner of its cell as seen towards the goal, until it can advance again: until its cell lets it come
    nearer to its goal, by `ADVANCE_M`, than where it was stuck, or `PATIENCE_UPDATES` have passed.
    """

    def __init__(self) -> None:
        """Start with no robot stuck."""
        self._stuck: dict[str, _Stuck] = {}

    def target(self, name: str, place: Floats, goal: Floats, cell: BufferedCell) -> Floats:
        """Return a robot's target; to be called once per update.

        Args:
            name: Name of the robot.
            place: (2,) where it is (m, map frame).
            goal: (2,) its goal (m, map frame).
            cell: Its cell.

        Returns:
            (2,) a point of the cell (m, map frame).
        """
        near = cell.nearest(goal, place)
        short_m, away_m = float(np.hypot(*(goal - near))), float(np.hypot(*(goal - place)))
        before = self._stuck.pop(name, None)
        if before is None:
            stuck = _Stuck(short_m, 0) if np.hypot(*(near - place)) < STANDS_M else None
        elif short_m < before.short_m - ADVANCE_M or before.updates == PATIENCE_UPDATES:
            stuck = None
        else:
            stuck = _Stuck(before.short_m, before.updates + 1)
        if stuck is None or away_m <= AWAY_M or not len(cell.corners):
            return near
        self._stuck[name] = stuck
        return rightmost(cell.corners, place, goal)

    @property
    def stuck(self) -> frozenset[str]:
        """Robots that are being sent aside."""
        return frozenset(self._stuck)


def rightmost(corners: Floats, place: Floats, goal: Floats) -> Floats:
    """Return the corner farthest to the right of the line from a place to a goal; of equals the farthest along it.

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
