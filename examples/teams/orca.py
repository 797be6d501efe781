"""ORCA: each robot takes the velocity nearest to its wish with which it meets nobody within a time τ.

Each neighbour allows a half-plane of velocities, (u − (v_i + w/2))·n ≥ 0, w the least change that leaves the velocity
obstacle: each does half. Van den Berg, Guy, Lin, Manocha, International Symposium on Robotics Research, 2009; with the
tracking error of unicycles in the radius: Alonso-Mora et al., Distributed Autonomous Robotic Systems, 2010.
"""

import cmath
import json
import math

import daqp
import numpy as np

from touchline.team_algorithms import HOLD, Me, Neighbours, VelocityWish, Wish


class Orca:
    """Straight to the goal, turned right by `turn_rad`; `more_m` is the tracking error, `horizon_s` τ."""

    def __init__(self, horizon_s: float = 3.0, more_m: float = 0.1, turn_rad: float = 0.3) -> None:
        self._horizon_s, self._more_m, self._turn = horizon_s, more_m, cmath.rect(1.0, -turn_rad)
        self._near = Neighbours[list[float]]()

    def start(self, me: Me) -> None:
        self._wide_m, self._period_s = 2.0 * (me.radius_m + self._more_m), me.period_s

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, json.loads(payload), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        message = json.dumps([round(each, 3) for each in (me.x_m, me.y_m, me.vx_mps, me.vy_mps)]).encode()
        if me.goal_m is None:
            return HOLD, message
        here, own_mps, most_mps = complex(me.x_m, me.y_m), complex(me.vx_mps, me.vy_mps), me.speed_max_mps
        way = complex(*me.goal_m) - here
        wish = way * most_mps / max(abs(way), most_mps) * (self._turn if abs(way) > 1.0 else 1.0)
        planes = [(x, y, d - me.radius_m - x * me.x_m - y * me.y_m) for x, y, d in me.area.sides.tolist()]
        for (x, y, vx, vy), age_s in self._near.known(me.now_s).values():
            planes.append(self._plane(own_mps, complex(x, y) + age_s * complex(vx, vy) - here, complex(vx, vy)))
        planes += [(math.cos(k * math.tau / 16), math.sin(k * math.tau / 16), most_mps) for k in range(16)]
        rows = np.array(planes)
        soft, none = np.full(len(rows), 8, dtype=np.int32), np.full(len(rows), -1e9)  # rather a little wrong than none
        wished = np.array((wish.real, wish.imag))
        best, *_ = daqp.solve(np.eye(2), -wished, rows[:, :2].copy(), rows[:, 2].copy(), none, soft)
        return VelocityWish.of(complex(*best), most_mps), message

    def _plane(self, own_mps: complex, off: complex, its_mps: complex) -> tuple[float, float, float]:
        """Return the velocities u, −n·u ≤ limit, that a neighbour at an offset allows: −n and the limit."""
        r, far, toward = self._wide_m, abs(off) > self._wide_m, own_mps - its_mps
        time_s = self._horizon_s if far else self._period_s
        w = toward - off / time_s
        if not far or (w.conjugate() * off).real < -r * abs(w):  # the circle at the end of the obstacle is nearest
            n = w / max(abs(w), 1e-9)
            change = (r / time_s - abs(w)) * n
        else:  # one of its legs
            side = math.copysign(1.0, (off.conjugate() * w).imag)
            n = 1j * side * off * complex(math.sqrt(abs(off) ** 2 - r**2), side * r) / abs(off) ** 2
            change = -(toward.conjugate() * n).real * n
        return -n.real, -n.imag, -(n.conjugate() * (own_mps + 0.5 * change)).real
