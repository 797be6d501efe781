"""Ways between painted segments: of all turns on offer, tight and slow to wide and fast, those that take least time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from services.planner.ccd import ContinuousDubins
from services.planner.clothoid import Floats, Piece, PiecePath, joined
from services.planner.limits import TURN_SPEEDS_MPS, Limits
from services.planner.method import CurveEnd, TransitionMethod, before, carried_on
from services.planner.passes import path_time

# Braking before a tight turn is planned with this share of the acceleration, so that it is slow enough in time.
BRAKING_SHARE = 0.98


class Turns(NamedTuple):
    """Turns on offer, made for a speed (m/s), as a method."""

    speed_mps: float
    method: TransitionMethod


class Way(NamedTuple):
    """A way between two painted segments and how long it takes (s)."""

    seconds: float
    path: PiecePath


@dataclass(frozen=True)
class Ways:
    """Finds ways with one of several turns."""

    limits: Limits
    turns: tuple[Turns, ...]
    lead: Callable[[float], TransitionMethod]

    @classmethod
    def curvature_continuous(cls, limits: Limits) -> "Ways":
        """With CC turns made for several speeds, as far as the limits let them differ."""
        fastest = max(limits.transit_speed_mps, TURN_SPEEDS_MPS[0])
        speeds = [v for v in TURN_SPEEDS_MPS if v < fastest] + [fastest]
        offers: dict[tuple[float, float], float] = {}
        for speed in speeds:
            if (turn := limits.turn_at(min(speed, 0.95 * limits.rim_speed_mps))) not in offers:
                offers[turn] = speed
            else:
                offers[turn] = max(offers[turn], speed)
        return cls(
            limits,
            tuple(Turns(speed, ContinuousDubins(*turn)) for turn, speed in offers.items()),
            lambda speed: ContinuousDubins(*limits.turn_at(speed)),
        )

    @classmethod
    def of_one(cls, method: TransitionMethod, limits: Limits) -> "Ways":
        """With the turns of one method, whatever the speed."""
        return cls(limits, (Turns(limits.rim_speed_mps, method),), lambda speed: method)

    def lead_out(self, turns: Turns, curvature_1pm: float) -> tuple[Piece, ...]:
        """What follows a painted curve of that curvature: to curvature 0, and on till slow enough for the turns."""
        speed = self.limits.steady_speed_mps(curvature_1pm)
        return joined((*self.lead(speed).lead_out(curvature_1pm), Piece(self.pad_m(speed, turns))))

    def lead_in(self, turns: Turns, curvature_1pm: float) -> tuple[Piece, ...]:
        """What comes before a painted curve of that curvature, likewise."""
        speed = self.limits.steady_speed_mps(curvature_1pm)
        return joined((Piece(self.pad_m(speed, turns)), *self.lead(speed).lead_in(curvature_1pm)))

    def pad_m(self, speed_mps: float, turns: Turns) -> float:
        """Length (m) of the straight between a line painted at a speed and the turns made for another."""
        slower = speed_mps**2 - turns.speed_mps**2
        return max(slower, 0.0) / (2.0 * BRAKING_SHARE * self.limits.acceleration_mps2)

    def between(self, start: CurveEnd, goal: CurveEnd) -> list[Way]:
        """Every way from the end of one painted segment to the beginning of the next, the quickest first."""
        speeds = [self.limits.steady_speed_mps(end.curvature_1pm) for end in (start, goal)]
        ways = []
        for turns in self.turns:
            out, into = self.lead_out(turns, start.curvature_1pm), self.lead_in(turns, goal.curvature_1pm)
            middle = turns.method.connect(PiecePath(start.pose, out).end, before(goal.pose, into))
            path = PiecePath(start.pose, joined((*out, *middle, *into)))
            ways.append(Way(self.seconds(path.pieces, *speeds), path))
        ways.sort(key=lambda way: way.seconds)
        straight_on = carried_on(start, goal, ways[0].path.length_m)
        return [Way(self.seconds(straight_on.pieces, *speeds), straight_on), *ways] if straight_on else ways

    def seconds(self, pieces: Sequence[Piece], first_mps: float, last_mps: float) -> float:
        """Seconds for pieces that are entered and left at these speeds."""
        table: Floats = np.array([piece[:3] for piece in pieces]).reshape(-1, 3)
        return float(path_time(table, len(table), first_mps, last_mps, self.limits.row)) if len(table) else 0.0
