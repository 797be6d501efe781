"""Perimeter guard: robots drive along the outline of the area, and spread evenly over it.

On the outline robot i is at s_i, and drives at v₀ + k [(s_{i+1} − s_i) − (s_i − s_{i−1})], the gap ahead less the gap
behind; a gap in which nobody is heard counts as the range of the radio. Only robots on the outline say where they are.
Susca, Bullo, Martínez, "Monitoring environmental boundaries with a robotic sensor network", IEEE Transactions on
Control Systems Technology 16(2), 2008.
"""

import json

from shapely import Point

from touchline.team_algorithms import GoalWish, Me, Neighbours, Wish

AHEAD_S = 1.0
"""Time after which a robot that brakes in time comes to a point ahead of it."""


class Perimeter:
    """Guard of the outline, `off_m` from it."""

    def __init__(self, off_m: float = 0.5, speed_mps: float = 0.15, gain_1ps: float = 0.2) -> None:
        self._off_m, self._speed_mps, self._gain = off_m, speed_mps, gain_1ps
        self._near = Neighbours[float]()

    def start(self, me: Me) -> None:
        self.curve = me.area.shape.buffer(-self._off_m, join_style="mitre").exterior

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, json.loads(payload), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        length_m, here = self.curve.length, Point(me.x_m, me.y_m)
        at_m = self.curve.project(here)
        there = [s_m + self._speed_mps * age_s for s_m, age_s in self._near.known(me.now_s).values()]
        ahead_m = min([me.range_m, *((s_m - at_m) % length_m for s_m in there)])
        behind_m = min([me.range_m, *((at_m - s_m) % length_m for s_m in there)])
        on = self.curve.distance(here) < me.radius_m
        speed_mps = min(max(self._speed_mps + self._gain * (ahead_m - behind_m), 0.0), me.speed_max_mps)
        goal = self.curve.interpolate((at_m + speed_mps * AHEAD_S) % length_m)
        return GoalWish(goal.x, goal.y), json.dumps(round(at_m, 3)).encode() if on else None
