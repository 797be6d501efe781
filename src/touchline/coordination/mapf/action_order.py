"""Order of moves that keeps a plan on a grid free of collisions, however late any robot is.

Robots need not keep the plan's time, only its order: a robot may enter a cell once the one before it there has left.
Robots that go round in a circle in one step begin together, once each is where its move begins. The graph of "before"
has no circles then, as all other edges lead forward in the plan's time, so nobody waits for ever. Hönig, Kiesel, Tinka,
Durham, Ayanian, "Persistent and robust execution of MAPF schedules in warehouses", IEEE Robotics and Automation Letters
4(2), 2019; waits in the plan are redundant and dropped.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int32]
Reached = NDArray[np.int64]


class Visit(NamedTuple):
    """Place in a robot's route.

    Attributes:
        who: Number of the robot.
        place: Number of the cell in its route.
    """

    who: int
    place: int


class ActionOrder:
    """Routes of all robots, and what has to be reached before a robot may enter a cell.

    Attributes:
        routes: Cells of each robot in order, its start first, without waits.
    """

    def __init__(self, paths: Ints) -> None:
        """Take a plan, cells (t, n) of all robots at each step."""
        self.routes = [[int(cell)] for cell in paths[0]]
        self._needed: list[list[tuple[Visit, ...]]] = [[()] for _ in self.routes]
        last = {int(cell): Visit(who, 0) for who, cell in enumerate(paths[0])}
        for before, after in pairwise(paths):
            moving = np.flatnonzero(before != after).tolist()
            here = {int(before[who]): who for who in moving}
            follows = {who: here[cell] for who in moving if (cell := int(after[who])) in here}
            for who in moving:
                earlier = last.get(int(after[who]))
                around = _circle(who, follows)
                needed = [Visit(each, len(self.routes[each]) - 1) for each in around]
                if not around and earlier is not None and earlier.who != who:
                    needed = [Visit(earlier.who, earlier.place + 1)]
                self._needed[who].append(tuple(needed))
            for who in moving:
                self.routes[who].append(int(after[who]))
                last[int(after[who])] = Visit(who, len(self.routes[who]) - 1)

    def horizon(self, who: int, reached: Reached) -> int:
        """Return the last place of a robot's route to which it may drive now.

        Args:
            who: Number of the robot.
            reached: (n,) number of the cell that each robot has reached in its route.
        """
        place, end = int(reached[who]), len(self.routes[who]) - 1
        while place < end and all(reached[each.who] >= each.place for each in self._needed[who][place + 1]):
            place += 1
        return place


def _circle(who: int, follows: dict[int, int]) -> list[int]:
    """Return the robots that go round in a circle with one, itself included; none if it is in no circle."""
    found, at = [who], follows.get(who)
    while at is not None and at != who and len(found) <= len(follows):
        found.append(at)
        at = follows.get(at)
    return found if at == who else []
