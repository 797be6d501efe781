"""Coverage with an importance φ that robots learn on the way: each drives to the centroid of its Voronoi cell.

φ̂_i(q) = K(q)·â_i with Gaussians K; u_i = k (Ĉ_i − x_i); â̇_i = −γ (Λ_i â_i − λ_i) + ζ Σ (â_j − â_i), then projected to
a ≥ a_min, else cells get a negative mass; Λ̇ = −αΛ + K Kᵀ, λ̇ = −αλ + φ(x_i) K. Robots know φ where they are. Schwager,
Rus, Slotine, International Journal of Robotics Research 28(3), 2009, without the term that its proof takes off â̇_i.
"""

import json

import numpy as np
from numpy.typing import NDArray

from touchline.team_algorithms import Me, Neighbours, PointShares, VelocityWish, Wish

Floats = NDArray[np.float64]
A_MIN, FORGET_1PS, LEARN_1PS, AGREE_1PS = 0.05, 0.02, 0.1, 0.2


class LearnedCoverage:
    """Coverage with `side`² Gaussians."""

    def __init__(self, side: int = 4, gain_1ps: float = 0.5) -> None:
        self._side, self._gain = side, gain_1ps
        self.a = np.ones(side * side)
        self._big, self._small = np.zeros((side * side, side * side)), np.zeros(side * side)
        self._near = Neighbours[Floats](keep_s=4.0)

    def start(self, me: Me) -> None:
        low, high = me.area.hull.min(axis=0), me.area.hull.max(axis=0)
        fine, coarse = ((np.indices((n, n)).reshape(2, -1).T + 0.5) / n for n in (40, self._side))
        self._middles, self._width_m = low + (high - low) * coarse, 0.6 * (high - low).max() / self._side
        points = low + (high - low) * fine
        self.points = points[me.area.holds(points, 0.0)]
        self._shares = PointShares(me.area, me.radius_m, self.points)
        self._basis = self.basis(self.points)

    def basis(self, places: Floats) -> Floats:
        """Return K at places (n, 2)."""
        off_m = np.linalg.norm(places[:, None] - self._middles, axis=2)
        return np.asarray(np.exp(-0.5 * (off_m / self._width_m) ** 2))

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, np.array(json.loads(payload)), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        here, period_s = np.array((me.x_m, me.y_m)), me.period_s
        others = [message for message, _ in self._near.known(me.now_s).values()]
        places = np.array([here, *(each[:2] for each in others)])
        shares = self._shares.of(places)  # by the shortest ways: towards their first parts, if they lead round corners
        own = shares.owners == 0
        mass = np.append(self._basis[own] @ self.a * shares.stretch[own], 1e-9)  # and its own place, if it has nothing
        wish = self._gain * (mass @ np.vstack((shares.leads[own], here)) / mass.sum() - here)
        known = self.basis(here[None])[0]
        self._big += period_s * (np.outer(known, known) - FORGET_1PS * self._big)
        self._small += period_s * (me.importance * known - FORGET_1PS * self._small)
        change = LEARN_1PS * (self._small - self._big @ self.a)
        change += AGREE_1PS * sum(each[2:] - self.a for each in others) / (len(others) + 1)
        self.a = np.maximum(self.a + period_s * change, A_MIN)
        message = json.dumps(np.round((*here, *self.a), 3).tolist()).encode()
        return VelocityWish.of(complex(*wish), me.speed_max_mps), message
