"""Rendezvous: all robots meet, and none loses a neighbour on the way.

Each drives to the middle of the smallest circle round itself and its neighbours, but leaves no disc of radius R/2 about
the middle between a neighbour and itself: so two robots within R stay so. Bodies end as near as they may come. Ando,
Oasa, Suzuki, Yamashita, IEEE Transactions on Robotics and Automation 15(5), 1999; the circle by Bădoiu, Clarkson,
"Smaller core-sets for balls", Symposium on Discrete Algorithms, 2003.
"""

import json
import math

from touchline.team_algorithms import Me, Neighbours, VelocityWish, Wish


class Rendezvous:
    """Circumcentre law; R is the range of the radio."""

    def __init__(self, gain_1ps: float = 0.5) -> None:
        self._gain = gain_1ps
        self._near = Neighbours[complex]()

    def start(self, me: Me) -> None:
        pass

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._near.note(sender, complex(*json.loads(payload)), age_s)

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        here, others = complex(me.x_m, me.y_m), [place for place, _ in self._near.known(me.now_s).values()]
        way = _middle([here, *others]) - here
        share = min([1.0, *(_share(here, other, way, me.range_m) for other in others)])
        wish = VelocityWish.of(self._gain * share * way, me.speed_max_mps)
        return wish, json.dumps((round(me.x_m, 3), round(me.y_m, 3))).encode()


def _middle(places: list[complex]) -> complex:
    """Return about the middle of the smallest circle round places."""
    middle = places[0]
    for step in range(1, 100):
        middle += (max(places, key=lambda place: abs(place - middle)) - middle) / (step + 1)
    return middle


def _share(here: complex, other: complex, way: complex, range_m: float) -> float:
    """Return the share of a way that stays in the disc of radius R/2 about the middle between two robots."""
    off = 0.5 * (here - other)
    a, b = abs(way) ** 2, (off.conjugate() * way).real
    room = max(0.25 * range_m**2 - abs(off) ** 2, 0.0)
    return (math.sqrt(b * b + a * room) - b) / a if a > 0.0 else 1.0
