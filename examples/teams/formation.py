"""Formation by consensus: robots take their places in a grid by what they know of their neighbours.

x_i drives to x_i − Σ [(x_i − x_j) − (d_i − d_j)] / number of neighbours, with the offsets d of the formation, which all
know; the mean instead of a gain and a sum is stable for any number of neighbours. The first robot knows where the
formation is to be, in the middle of the area, and the others follow. Goals instead of velocities let what keeps robots
apart lead them round each other. Olfati-Saber, Fax, Murray, Proceedings of the IEEE 95(1), 2007.
"""

import json
import math

from touchline.team_algorithms import HOLD, GoalWish, Me, Neighbours, Wish


class Formation:
    """Grid of robots, `apart_m` from each other."""

    def __init__(self, apart_m: float = 0.8) -> None:
        self._apart_m = apart_m
        self._near = Neighbours[complex]()

    def start(self, me: Me) -> None:
        columns = math.ceil(math.sqrt(len(me.team)))
        grid = [self._apart_m * complex(number % columns, number // columns) for number in range(len(me.team))]
        self.offsets = dict(zip(me.team, grid, strict=True))
        middle = complex(*(me.area.hull.min(axis=0) + me.area.hull.max(axis=0)) / 2)
        self._first = middle - complex(grid[columns - 1].real, grid[-1].imag) / 2

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, complex(*json.loads(payload)), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        message = json.dumps((round(me.x_m, 3), round(me.y_m, 3))).encode()
        own = self.offsets[me.name]
        wanted = [place - self.offsets[name] + own for name, (place, _) in self._near.known(me.now_s).items()]
        if me.name == me.team[0]:
            wanted = [self._first]
        if not wanted:
            return HOLD, message
        goal = sum(wanted) / len(wanted)
        return GoalWish(goal.real, goal.imag), message
