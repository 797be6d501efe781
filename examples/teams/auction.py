"""Auction: robots share out places among themselves, so that all together have about the shortest ways.

Each keeps for every place the highest bid that it has heard of, a price and a bidder. Who has no place, or was outbid,
bids for the one that is worth most to it, as much as that is better than the second best, and ε more. The ways end
within n·ε of the shortest. Bids only rise, so a lost message delays the end and changes nothing else. Robots wait until
no bid has changed for a while, as they hear each other where they start. Bertsekas, Annals of Operations Research 14,
1988; Zavlanos, Spesivtsev, Pappas, IEEE Conference on Decision and Control, 2008.
"""

import json
import math

from touchline.team_algorithms import HOLD, GoalWish, Me, Wish


class Auction:
    """Auction of places in a grid, `apart_m` from each other, in the middle of the area; ε is `least_mm`."""

    def __init__(self, apart_m: float = 0.8, least_mm: int = 100, calm_rounds: int = 10) -> None:
        self._apart_m, self._least_mm, self._calm_rounds = apart_m, least_mm, calm_rounds
        self.mine: int | None = None
        self._calm, self._known = 0, b""

    def start(self, me: Me) -> None:
        count, columns = len(me.team), math.ceil(math.sqrt(len(me.team)))
        middle = complex(*(me.area.hull.min(axis=0) + me.area.hull.max(axis=0)) / 2)
        corner = middle - self._apart_m * complex(columns - 1, (count - 1) // columns) / 2
        self.places = [corner + self._apart_m * complex(k % columns, k // columns) for k in range(count)]
        self.ways_m = [abs(place - complex(me.x_m, me.y_m)) for place in self.places]
        self._number = me.team.index(me.name)
        self._bids = [(0, -1)] * count  # price in mm, bidder

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        bids = json.loads(payload)
        self._bids = [max(own, (price, bidder)) for own, (price, bidder) in zip(self._bids, bids, strict=True)]

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        if self.mine is None or self._bids[self.mine][1] != self._number:
            self.mine = self._bid()
        message = json.dumps(self._bids, separators=(",", ":")).encode()
        self._calm = self._calm + 1 if message == self._known else 0
        self._known = message
        if self._calm < self._calm_rounds:
            return HOLD, message
        place = self.places[self.mine]
        return GoalWish(place.real, place.imag), message

    def _bid(self) -> int:
        """Bid for the place that is worth most; return its number."""
        worth = [-round(1000 * way_m) - price for way_m, (price, _) in zip(self.ways_m, self._bids, strict=True)]
        best, second = [*sorted(worth, reverse=True), worth[0]][:2]
        place = worth.index(best)
        self._bids[place] = (self._bids[place][0] + best - second + self._least_mm, self._number)
        return place
