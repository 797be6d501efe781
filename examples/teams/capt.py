"""CAPT: goals are shared out, and all robots drive there on straight lines, starting and arriving together.

Goals are assigned by the least sum of squared distances. If starts, and goals, are at least 2√2·R apart, no two robots
ever come nearer than 2R. That holds for points that move in step: robots turn first, and follow as well as they can.
Turpin, Michael, Kumar, "CAPT: concurrent assignment and planning of trajectories for multiple robots", International
Journal of Robotics Research 33(1), 2014. Central.
"""

import math
from collections.abc import Mapping

import numpy as np
from scipy.optimize import linear_sum_assignment

from touchline.team_algorithms import Team, VelocityWish, Wish


class Capt:
    """Assignment of places in a grid, `apart_m` from each other, in the middle of the area."""

    def __init__(
        self, apart_m: float = 0.8, turn_s: float = 2.0, speed_mps: float = 0.4, gain_1ps: float = 0.8
    ) -> None:
        self._apart_m, self._turn_s, self._speed_mps, self._gain = apart_m, turn_s, speed_mps, gain_1ps
        self.ways: dict[str, tuple[complex, complex]] = {}  # start and goal of each

    def decide(self, now: Team) -> Mapping[str, Wish]:
        if not self.ways:
            self._assign(now)
        return {name: self._wish(now, name) for name in now.robots}

    def _assign(self, now: Team) -> None:
        hull, count = next(iter(now.robots.values())).area.hull, len(now.robots)
        columns, number = math.ceil(math.sqrt(count)), np.arange(count)
        goals = self._apart_m * np.column_stack((number % columns, number // columns))
        goals += (hull.min(axis=0) + hull.max(axis=0) - goals.max(axis=0)) / 2
        starts = np.array([(me.x_m, me.y_m) for me in now.robots.values()])
        _, chosen = linear_sum_assignment(((starts[:, None] - goals) ** 2).sum(axis=2))
        ends = zip(starts, goals[chosen], strict=True)
        self.ways = {name: (complex(*a), complex(*b)) for name, (a, b) in zip(now.robots, ends, strict=True)}
        self._takes_s = 1.5 * max(abs(goal - start) for start, goal in self.ways.values()) / self._speed_mps

    def _wish(self, now: Team, name: str) -> Wish:
        (start, goal), me = self.ways[name], now.robots[name]
        if now.now_s < self._turn_s:
            return VelocityWish.of(1e-3 * (goal - start), 1e-3)
        time = min((now.now_s + me.period_s - self._turn_s) / self._takes_s, 1.0)
        done, rate_1ps = time**2 * (3.0 - 2.0 * time), 6.0 * time * (1.0 - time) / self._takes_s
        off = start + done * (goal - start) - complex(me.x_m, me.y_m)
        return VelocityWish.of(rate_1ps * (goal - start) + self._gain * off, me.speed_max_mps)
