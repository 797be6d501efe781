"""Algorithms whose wishes are compared: straight to the goal, and what Robotarium's certificates make of that."""

import cmath
import math
from collections.abc import Mapping

import daqp
import numpy as np

from touchline.team_algorithms import Me, Team, TwistWish, VelocityWish, Wish

THERE_M = 0.05
AHEAD_M = 0.05
BODY_M = 0.177
GAMMA_PER_M4S = 100.0


def straight(me: Me, right_deg: float = 0.0) -> complex:
    """Velocity (m/s) to the goal, turned right by an angle while it is far; 0 once there."""
    goal = complex(*(me.goal_m or (me.x_m, me.y_m)))
    way = goal - complex(me.x_m, me.y_m)
    if abs(way) < THERE_M:
        return 0j
    turned = cmath.rect(1.0, -math.radians(right_deg)) if abs(way) > 2.0 else 1.0
    wish: complex = way / abs(way) * turned * min(me.speed_max_mps, 1.5 * abs(way))
    return wish


class Straight:
    """Every robot straight to its goal."""

    def __init__(self, right_deg: float = 0.0) -> None:
        self._right_deg = right_deg

    def decide(self, now: Team) -> Mapping[str, Wish]:
        wishes = {name: straight(me, self._right_deg) for name, me in now.robots.items()}
        return {name: VelocityWish(wish.real, wish.imag) for name, wish in wishes.items()}


class Certified:
    """Straight wishes through barrier certificates for points ahead, without inertia, as on the Robotarium.

    −2·Δpᵀ(u_i − u_j) ≤ γ·h³, h = |Δp|² − (D + 2ℓ)², for points ℓ ahead of the centres; D is twice the body's radius.
    Where there is no answer, all stand. Updates are as often as a team can have them, 0.1 s. Wilson et al., "The
    Robotarium", IEEE Control Systems Magazine 40(1), 2020.
    """

    def __init__(self, gamma: float = GAMMA_PER_M4S) -> None:
        self._gamma = gamma
        self.infeasible = 0

    def decide(self, now: Team) -> Mapping[str, Wish]:
        robots = list(now.robots.values())
        headings = np.array([cmath.rect(1.0, me.heading_rad) for me in robots])
        points = np.array([complex(me.x_m, me.y_m) for me in robots]) + AHEAD_M * headings
        wished = np.array([straight(me) for me in robots])
        granted = self._certified(points, wished, robots[0].speed_max_mps)
        own = granted * headings.conj()
        return {me.name: TwistWish(float(own[k].real), float(own[k].imag / AHEAD_M)) for k, me in enumerate(robots)}

    def _certified(self, points: np.ndarray, wished: np.ndarray, most_mps: float) -> np.ndarray:
        n = len(points)
        i, j = np.triu_indices(n, 1)
        apart = points[i] - points[j]
        h = np.abs(apart) ** 2 - (2.0 * BODY_M + 2.0 * AHEAD_M) ** 2
        rows, every = np.zeros((len(i), 2 * n)), np.arange(len(i))
        for axis, part in enumerate((apart.real, apart.imag)):
            rows[every, 2 * i + axis] = -2.0 * part
            rows[every, 2 * j + axis] = 2.0 * part
        box = np.full(2 * n, most_mps)
        upper = np.concatenate((box, self._gamma * h**3))
        lower = np.concatenate((-box, np.full(len(i), -1e30)))
        flat = np.column_stack((wished.real, wished.imag)).ravel()
        answer = daqp.solve(np.eye(2 * n), -flat, rows, upper, lower)
        if answer[2] <= 0:
            self.infeasible += 1
            return np.zeros(n, dtype=np.complex128)
        found = np.reshape(answer[0], (n, 2))
        return found[:, 0] + 1j * found[:, 1]
