"""BVC: each robot drives to the place nearest to its goal in its Voronoi cell, shrunk by its radius.

Cells do not overlap, so robots that stop in time never touch. Robots that block each other step aside to the right.
Zhou, Wang, Bandyopadhyay, Schwager, "Fast, on-line collision avoidance for dynamic vehicles using buffered Voronoi
cells", IEEE Robotics and Automation Letters 2(2), 2017.
"""

import cmath
import json

import daqp
import numpy as np

from touchline.team_algorithms import HOLD, Me, Neighbours, VelocityWish, Wish


class Bvc:
    """Buffered Voronoi cells of the robots that are heard, within the hull of the area; `more_m` is for tracking."""

    def __init__(self, gain_1ps: float = 1.0, more_m: float = 0.02) -> None:
        self._gain, self._more_m = gain_1ps, more_m
        self._near = Neighbours[complex]()
        self._turn_rad = 0.0

    def start(self, me: Me) -> None:
        pass

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, complex(*json.loads(payload)), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        message = json.dumps((round(me.x_m, 3), round(me.y_m, 3))).encode()
        if me.goal_m is None:
            return HOLD, message
        here, goal = complex(me.x_m, me.y_m), complex(*me.goal_m)
        off_m = me.radius_m + self._more_m
        sides = [(x, y, d - off_m) for x, y, d in me.area.sides.tolist()]
        for place, _ in self._near.known(me.now_s).values():
            n = (place - here) / abs(place - here)
            sides.append((n.real, n.imag, (n.conjugate() * (here + place)).real / 2 - off_m))
        stands = abs(complex(me.vx_mps, me.vy_mps)) < 0.05 and abs(goal - here) > 0.1
        self._turn_rad = min(self._turn_rad + 0.2, 1.6) if stands else max(self._turn_rad - 0.1, 0.0)
        aim = here + (goal - here) * cmath.rect(1.0, -self._turn_rad)
        rows = np.array(sides)
        nearest, _, solved, _ = daqp.solve(
            np.eye(2), -np.array((aim.real, aim.imag)), np.ascontiguousarray(rows[:, :2]), rows[:, 2].copy()
        )
        if solved != 1:  # the cell is empty: others are nearer than two radii
            return HOLD, message
        return VelocityWish.of(self._gain * (complex(*nearest) - here), me.speed_max_mps), message
