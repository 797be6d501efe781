"""Cyclic pursuit: each robot drives after the next one, so that all meet, circle or spiral out.

u_i = k·Rot(α)·(x_{i+1} − x_i); α < π/n: they meet, = π/n: they circle, > π/n: they spiral out. Marshall, Broucke,
Francis, IEEE Transactions on Automatic Control 49(11), 2004; Pavone, Frazzoli, Journal of Dynamic Systems, Measurement,
and Control 129(5), 2007.
"""

import json
import math

from touchline.team_algorithms import HOLD, Me, VelocityWish, Wish


class CyclicPursuit:
    """Pursuit of the next robot by name; `turn` is α as a multiple of π/n."""

    def __init__(self, turn: float = 1.0, gain_1ps: float = 0.5) -> None:
        self._turn, self._gain = turn, gain_1ps
        self._prey = ""
        self._seen: tuple[float, float] | None = None

    def start(self, me: Me) -> None:
        self._prey = me.team[(me.team.index(me.name) + 1) % len(me.team)]

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        if sender == self._prey:
            self._seen = tuple(json.loads(payload))

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        message = json.dumps((me.x_m, me.y_m)).encode()
        if self._seen is None:
            return HOLD, message
        angle = self._turn * math.pi / len(me.team)
        way = complex(self._seen[0] - me.x_m, self._seen[1] - me.y_m)
        wish = self._gain * way * complex(math.cos(angle), math.sin(angle))
        return VelocityWish.of(wish, me.speed_max_mps), message
