"""Order of moves that keeps a plan on a grid free of collisions, however late any robot is.

Robots need not keep the plan's time, only its order: a robot may enter a cell once the one before it there may leave,
behind that one, at the distance that plans or cells keep. So robots in a row begin together, not one after another.
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
        follows: Whether another may follow once the robot is on its way there.
    """

    who: int
    place: int
    follows: bool = False


class ActionOrder:
    """Routes of all robots, and what has to be reached before a robot may enter a cell.

    Attributes:
        routes: Cells of each robot in order, its start first, without waits.
        steps: Steps of the plan.
    """

    def __init__(self, paths: Ints) -> None:
        """Take a plan, cells (t, n) of all robots at each step."""
        self.routes, self.steps = [[int(cell)] for cell in paths[0]], len(paths) - 1
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
                    needed = [Visit(earlier.who, earlier.place + 1, follows=True)]
                self._needed[who].append(tuple(needed))
            for who in moving:
                self.routes[who].append(int(after[who]))
                last[int(after[who])] = Visit(who, len(self.routes[who]) - 1)

    def horizons(self, reached: Reached) -> list[int]:
        """Return the last place of each robot's route to which it may drive now, behind those that leave.

        No part leads there and back: nobody could say where on it a robot is, and it could leave out to make way.

        Args:
            reached: (n,) number of the cell that each robot has reached in its route.
        """
        leaving = self._leaving(reached)
        return [self._horizon(who, reached, leaving) for who in range(len(self.routes))]

    def _leaving(self, reached: Reached) -> set[int]:
        """Return the robots that may make their next move, as all before it are done or can be begun, too."""
        found, waiting = set[int](), set(range(len(self.routes)))
        while free := {who for who in waiting if self._horizon(who, reached, found) > reached[who]}:
            found |= free
            waiting -= free
        return found

    def _horizon(self, who: int, reached: Reached, leaving: set[int]) -> int:
        here, route = int(reached[who]), self.routes[who]
        place = here
        while place + 1 < len(route) and route[place + 1] not in route[here : place + 1]:
            if not all(self._passed(each, reached, leaving) for each in self._needed[who][place + 1]):
                break
            place += 1
        return place

    @staticmethod
    def _passed(visit: Visit, reached: Reached, leaving: set[int]) -> bool:
        """Return whether a robot has reached a place, or is on its way there, where that is enough."""
        here = reached[visit.who]
        return bool(here >= visit.place or (visit.follows and here == visit.place - 1 and visit.who in leaving))


def _circle(who: int, follows: dict[int, int]) -> list[int]:
    """Return the robots that go round in a circle with one, itself included; none if it is in no circle."""
    found, at = [who], follows.get(who)
    while at is not None and at != who and len(found) <= len(follows):
        found.append(at)
        at = follows.get(at)
    return found if at == who else []
