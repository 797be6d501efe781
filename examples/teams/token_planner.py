"""Token passing: who has the token reserves a way to its goal on which it meets nobody, and passes the token on.

Only the holder changes the token, and all repeat the newest that they know, so losses only delay it. A way keeps off
all others, whenever these are driven: all arrive if each has one past all other starts and goals. A message has room
for some 30 robots. After Ma, Li, Kumar, Koenig, AAMAS 2017 (multi-agent pickup and delivery), whose ways have times.
"""

import json
import math

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from touchline.team_algorithms import Me, PathWish, Wish


class TokenPlanner:
    """Planner on a grid with `pitch_m`; ways keep `more_m` more apart than two radii."""

    def __init__(self, pitch_m: float = 0.25, more_m: float = 0.1) -> None:
        self._pitch_m, self._more_m = pitch_m, more_m

    def start(self, me: Me) -> None:
        self._own, self._apart_m = me.team.index(me.name), 2.0 * me.radius_m + self._more_m
        (x, y), (to_x, to_y) = me.area.hull.min(axis=0), me.area.hull.max(axis=0)
        grid = np.mgrid[x : to_x : self._pitch_m, y : to_y : self._pitch_m].reshape(2, -1).T
        self._grid = grid[me.area.holds(grid, me.radius_m + 0.5 * self._more_m)]
        self._number, self._holder, self._ways = 0, 0, [list[tuple[float, float]]() for _ in me.team]

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        number, holder, ways = json.loads(payload)
        if number > self._number:
            self._number, self._holder, self._ways = number, holder, ways

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        here, goal = (me.x_m, me.y_m), me.goal_m or (me.x_m, me.y_m)
        own = self._ways[self._own] or [here]
        if self._holder == self._own:
            if all(self._ways) and len(json.dumps(self._ways)) < 900 and math.dist(own[-1], here) < 0.15:
                own = self._planned(here, goal) or own[-1:]
            self._ways[self._own] = [(round(x, 2), round(y, 2)) for x, y in own]
            self._number, self._holder = self._number + 1, (self._own + 1) % len(me.team)
        return PathWish(own), json.dumps((self._number, self._holder, self._ways), separators=(",", ":")).encode()

    def _planned(self, here: tuple[float, float], goal: tuple[float, float]) -> list[tuple[float, float]]:
        """Return the shortest way that keeps off all others; none if there is none."""
        others = [way if len(way) > 1 else 2 * way for k, way in enumerate(self._ways) if k != self._own]
        places, taken = np.vstack((here, goal, self._grid)), shapely.MultiLineString(others)
        free = shapely.distance(shapely.points(places), taken) >= self._apart_m
        places = places[free | (np.arange(len(free)) == 0)]
        one, other = cKDTree(places).query_pairs(1.5 * self._pitch_m, output_type="ndarray").T
        lengths = csr_array((np.hypot(*(places[one] - places[other]).T), (one, other)), shape=2 * places.shape[:1])
        _, before = dijkstra(lengths, directed=False, indices=[0], return_predecessors=True)
        way = [1] * bool(free[1] and before[0, 1] >= 0)
        while way and way[-1]:
            way.append(int(before[0, way[-1]]))
        return [(x, y) for x, y in shapely.LineString(places[way[::-1]]).simplify(0.05).coords]
