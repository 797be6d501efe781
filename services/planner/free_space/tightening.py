"""Tightening of ways: places are left out, pulled to the chord between their neighbours, and corners are cut."""

from __future__ import annotations

import math

import numpy as np

from touchline.services.planner.free_space.legs import STOP_M, Legs, WalledBody, legs_length
from touchline.services.planner.geometry.clothoid import Floats, PathPose

ROUNDS = 12
# Rounds go on while they save this share.
GAIN = 0.002
# Shares by which a place is pulled, and lengths (m) that are cut off a corner, as shares of the shorter straight.
PULLS = (1.0, 0.5, 0.25, 0.1)
CUTS = (0.9, 0.5, 0.2)
# Straights beyond this many places ahead are not tried as short cuts.
AHEAD = 12
# Turns between this and its supplement (rad) make a corner.
STRAIGHT_RAD = math.radians(2.0)
# A change of direction costs as much as turning on the spot by this (rad).
STOP_RAD = 1.0


def tightened(legs: Legs, goal: PathPose, body: WalledBody) -> Legs:
    """Shorten a way, each step of which is checked."""
    work = _Tightening(legs, goal, body)
    cost = work.cost
    for _ in range(ROUNDS):
        work.leave_out()
        work.pull()
        work.cut()
        if work.cost > (1.0 - GAIN) * cost:
            break
        cost = work.cost
    work.leave_out()
    return _directed(body.legs(work.places, legs.start, goal), goal, body)


def _directed(legs: Legs | None, goal: PathPose, body: WalledBody) -> Legs:
    """Drive each straight forward or backward so that the robot turns and stops least."""
    assert legs is not None  # each step was checked
    places = legs.places
    ahead = np.arctan2(*np.diff(places[:, :2], axis=0).T[::-1])
    free = body.drives(np.hstack((places[:-1, :2], places[1:, :2])))
    best: list[tuple[float, float, tuple[float, ...]]] = [(0.0, legs.start.heading_rad, ())]
    for k, heading in enumerate(ahead):
        offers = []
        for sign in body.senses:
            bit = 1 if sign > 0.0 else 2
            aimed = heading if sign > 0.0 else heading + math.pi
            ways = [
                (cost + _turn_cost(turn) + (STOP_RAD if signs and signs[-1] != sign else 0.0), aimed, (*signs, sign))
                for cost, entry, signs in best
                if free[k] & bit and (turn := body.turns(places[k : k + 1], entry, aimed)).size
            ]
            offers += [min(ways)] if ways else []
        best = offers
    ends = [
        (cost + _turn_cost(turn), signs)
        for cost, entry, signs in best
        if (turn := body.turns(places[-1:], entry, goal.heading_rad)).size
    ]
    directed = np.column_stack((places[:, :2], (1.0, *min(ends)[1])))
    return body.legs(directed, legs.start, goal) or legs


def _turn_cost(turn: Floats) -> float:
    return float(abs(turn[0]))


class _Tightening:
    """A way that becomes shorter."""

    def __init__(self, legs: Legs, goal: PathPose, body: WalledBody) -> None:
        self.places, self._start, self._goal, self._body = legs.places, legs.start, goal, body

    @property
    def cost(self) -> float:
        """Length, and stops (m)."""
        return _cost(self.places)

    def leave_out(self) -> None:
        """Replace straights by one, forward or backward."""
        i = 0
        while i < len(self.places) - 2:
            for j in range(min(len(self.places) - 1, i + AHEAD), i + 1, -1):
                signs = (self.places[j, 2], -self.places[j, 2])[: len(self._body.senses)]
                if any(self._replaced(i, j, np.array([[*self.places[j, :2], sign]])) for sign in signs):
                    break
            i += 1

    def pull(self) -> None:
        """Pull places to the chord between their neighbours."""
        for i in range(1, len(self.places) - 1):
            before, at, after = self.places[i - 1 : i + 2, :2]
            chord = after - before
            square = float(chord @ chord)
            share = min(max(float((at - before) @ chord) / square, 0.0), 1.0) if square else 0.0
            aim = before + share * chord
            for pull in PULLS:
                moved = at + pull * (aim - at)
                if self._replaced(i - 1, i + 1, np.array([[*moved, self.places[i, 2]], self.places[i + 1]])):
                    break

    def cut(self) -> None:
        """Cut corners between straights."""
        i = 1
        while i < len(self.places) - 1:
            before, at, after = self.places[i - 1 : i + 2, :2]
            first, second = at - before, after - at
            lengths = math.hypot(*first), math.hypot(*second)
            turn = abs(math.remainder(math.atan2(*second[::-1]) - math.atan2(*first[::-1]), math.tau))
            if min(lengths) > 4.0 * STOP_M and turn > STRAIGHT_RAD:
                for cut in CUTS:
                    off = cut * min(lengths)
                    a, b = at - off / lengths[0] * first, at + off / lengths[1] * second
                    rows = np.array([[*a, self.places[i, 2]], [*b, self.places[i + 1, 2]], self.places[i + 1]])
                    if self._replaced(i - 1, i + 1, rows):
                        i += 1
                        break
            i += 1

    def _replaced(self, i: int, j: int, rows: Floats) -> bool:
        """Replace the places after i up to j, if that saves something and is free."""
        places = self.places
        new = np.concatenate((places[i : i + 1], rows))
        if _cost(new) > _cost(places[i : j + 1]) - 1e-6:
            return False
        # The body leaves the straight before i and takes the one behind j with other turns.
        entry = _heading(places, i) if i else self._start.heading_rad
        exit_ = _heading(places, j + 1) if j + 1 < len(places) else self._goal.heading_rad
        if not len(self._body.turns(new, entry, exit_)):
            return False
        self.places = np.concatenate((places[: i + 1], rows, places[j + 1 :]))
        return True


def _cost(places: Floats) -> float:
    return legs_length(places) + STOP_M * (len(places) - 1)


def _heading(places: Floats, k: int) -> float:
    """Heading on the straight that ends at place k."""
    x, y = places[k, :2] - places[k - 1, :2]
    return math.atan2(y, x) + (math.pi if places[k, 2] < 0.0 else 0.0)
