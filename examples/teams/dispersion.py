"""Dispersion: robots push each other and walls away, until they are spread over the area.

u_i = k Σ (1/d − 1/R) (x_i − x_j)/d³ over all within R, and the same for the nearest place of a wall. Howard, Matarić,
Sukhatme, "Mobile sensor network deployment using potential fields", Distributed Autonomous Robotic Systems, 2002.
"""

import json

from shapely import Point

from touchline.team_algorithms import Me, Neighbours, VelocityWish, Wish


class Dispersion:
    """Potential field; R is the range of the radio, of walls half of that."""

    def __init__(self, gain: float = 0.2) -> None:
        self._gain = gain
        self._near = Neighbours[complex]()

    def start(self, me: Me) -> None:
        self._walls = me.area.shape.boundary

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, complex(*json.loads(payload)), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        here = complex(me.x_m, me.y_m)
        wall = self._walls.interpolate(self._walls.project(Point(me.x_m, me.y_m)))
        push = _push(here - complex(wall.x, wall.y), 0.5 * me.range_m)
        push += sum(_push(here - place, me.range_m) for place, _ in self._near.known(me.now_s).values())
        message = json.dumps((round(me.x_m, 3), round(me.y_m, 3))).encode()
        return VelocityWish.of(self._gain * push, me.speed_max_mps), message


def _push(off: complex, range_m: float) -> complex:
    """Return the push from a place that is so far off."""
    return max(1.0 / abs(off) - 1.0 / range_m, 0.0) * off / abs(off) ** 3
