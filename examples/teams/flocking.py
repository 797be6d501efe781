"""Flocking: robots keep a distance d from each other, match their velocities, and follow a moving point γ.

u̇_i = a Σ φ_α(‖x_j − x_i‖_σ) n_ij + b Σ a_ij (v_j − v_i) − c₁ (x_i − x_γ) − c₂ (v_i − v_γ), algorithm 2 of Olfati-Saber,
IEEE Transactions on Automatic Control 51(3), 2006. Without the terms of γ flocks break up. Gains suit updates of 0.4 s:
b times the number of neighbours, 6, must stay well below one over that. Here γ drives a circle about the middle.
"""

import cmath
import json
import math

from touchline.team_algorithms import Me, Neighbours, VelocityWish, Wish

EPSILON, H, PUSH, MATCH, C1 = 0.1, 0.2, 2.0, 0.2, 0.1


class Flocking:
    """Flock with a lattice of side `apart_m`; γ drives at `speed_mps` on a circle of `radius_m`."""

    def __init__(self, apart_m: float = 0.8, radius_m: float = 1.0, speed_mps: float = 0.15) -> None:
        self._d, self._r = _sigma(apart_m), _sigma(1.2 * apart_m)
        self._radius_m, self._speed_mps = radius_m, speed_mps
        self._near = Neighbours[tuple[complex, complex]](keep_s=1.0)

    def start(self, me: Me) -> None:
        self._middle = complex(*(me.area.hull.min(axis=0) + me.area.hull.max(axis=0)) / 2)

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        x, y, vx, vy = json.loads(payload)
        self._near.note(sender, (complex(x, y), complex(vx, vy)), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        here, velocity = complex(me.x_m, me.y_m), complex(me.vx_mps, me.vy_mps)
        gamma = cmath.rect(self._radius_m, self._speed_mps / self._radius_m * me.now_s)
        gamma_mps = 1j * gamma * self._speed_mps / self._radius_m
        u = -C1 * (here - self._middle - gamma) - 2.0 * math.sqrt(C1) * (velocity - gamma_mps)
        for (place, its_mps), age_s in self._near.known(me.now_s).values():
            off = place + age_s * its_mps - here
            near, slope = _bump(_sigma(abs(off)) / self._r), _sigma(abs(off)) - self._d
            n = off / math.sqrt(1.0 + EPSILON * abs(off) ** 2)
            u += near * (PUSH * slope / math.sqrt(1.0 + slope**2) * n + MATCH * (its_mps - velocity))
        message = [round(each, 3) for each in (me.x_m, me.y_m, me.vx_mps, me.vy_mps)]
        return VelocityWish.of(velocity + u * me.period_s, me.speed_max_mps), json.dumps(message).encode()


def _sigma(z: float) -> float:
    """Return the σ-norm."""
    return (math.sqrt(1.0 + EPSILON * z * z) - 1.0) / EPSILON


def _bump(z: float) -> float:
    """Return ρ_h, which falls from 1 to 0 between h and 1."""
    return 1.0 if z < H else 0.5 * (1.0 + math.cos(math.pi * (z - H) / (1.0 - H))) if z < 1.0 else 0.0
