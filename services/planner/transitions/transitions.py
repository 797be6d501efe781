"""Choice of the fastest transition between two swaths from a family of turns of several speeds."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from touchline.services.planner.geometry.clothoid import (
    Floats,
    Ints,
    PathPose,
    Piece,
    PiecePath,
    arc_displacement,
    joined,
)
from touchline.services.planner.limits import TURN_SPEEDS_MPS, Limits
from touchline.services.planner.speed.topp import path_time
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.steering.method import CurveEnd, TransitionMethod, before, extension

# Fraction of the acceleration that plans use to brake before a tight turn, so that the robot is slow enough in time.
BRAKING_SHARE = 0.98
# Fraction of the maximum speed up to which turns are made; beyond it the drive has no curvature to spare.
FASTEST_SHARE = 0.95
# Abilities of a robot besides driving forward.
REVERSING, SPINNING = "reversing", "spinning"

# Creates a method for a maximum curvature (1/m) and sharpness (1/m²).
MakeMethod = Callable[[float, float], TransitionMethod]


class Turns(NamedTuple):
    """Member of a family: speed (m/s) of its turns, maximum curvature (1/m) and sharpness (1/m²), method."""

    speed_mps: float
    curvature_1pm: float
    sharpness_1pm2: float
    method: TransitionMethod


class Transition(NamedTuple):
    """Path between two painted segments and its duration (s)."""

    seconds: float
    path: PiecePath


class Lead(NamedTuple):
    """Pieces between a painted curve and the turns (as driven away from the curve), and the curvature at their end."""

    pieces: tuple[Piece, ...]
    curvature_1pm: float


class Priced(NamedTuple):
    """Quickest transition of each of n pairs.

    Attributes:
        seconds: (n,) durations.
        pieces: (n, k, 5) columns of `Piece`, from the end of the painted segment on.
        counts: (n,) numbers of pieces.
    """

    seconds: Floats
    pieces: Floats
    counts: Ints


# Prices pairs (n, 2) of the numbers of an end and a beginning; the flag asks for the closer pass with more transitions.
Timer = Callable[[Ints, bool], Priced]


class Pricing(Protocol):
    """Interface that times many transitions of a method at once, regardless of obstacles."""

    @property
    def part(self) -> int:
        """Number of pairs that are timed within about 50 ms."""

    @property
    def looks_closer(self) -> bool:
        """True if near pairs may have quicker transitions that only the closer pass finds."""

    def rough_s(self, transitions: "TransitionFamily", ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        """Approximate seconds (ends, begins) from every end to every beginning, to tell which are near."""

    def timer(self, transitions: "TransitionFamily", ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Timer:
        """Create the function that times the quickest transitions of pairs of these ends and beginnings."""


@dataclass(frozen=True)
class TransitionFamily:
    """A method's transitions with a family of turns, of which the fastest between two poses is chosen.

    Attributes:
        limits: Limits of the plan.
        turns: Members of the family.
        standing: Abilities of the robot besides driving forward.
        pricing: The method's own pricing; None: one by one.
    """

    limits: Limits
    turns: tuple[Turns, ...]
    standing: frozenset[str] = frozenset()
    pricing: Pricing | None = None

    @classmethod
    def by_time(cls, make: MakeMethod, limits: Limits, pricing: Pricing | None = None) -> "TransitionFamily":
        """Create a family with turns for several speeds, as far as the limits let them differ.

        One more turn is entered at paint speed and tightens while the robot brakes, without a straight before it.
        Wheels can do both at once; tyres that slide before cannot.

        Args:
            make: Creates the method for a maximum curvature (1/m) and sharpness (1/m²).
            limits: Limits of the plan.
            pricing: The method's own pricing; None: transitions are timed one by one.
        """
        fastest = min(limits.transit_speed_mps, FASTEST_SHARE * limits.drive.max_speed_mps)
        offers = {limits.turn_at(v): v for v in [*(v for v in TURN_SPEEDS_MPS if v < fastest), fastest]}
        if limits.drive_limits_turns:
            painting, slowest = limits.paint_speed_mps, min(TURN_SPEEDS_MPS[0], fastest)
            offers.setdefault((limits.turn_at(slowest)[0], limits.turn_at(painting)[1]), painting)
        turns = tuple(Turns(speed, *turn, make(*turn)) for turn, speed in offers.items())
        return cls(limits, turns, pricing=pricing)

    @classmethod
    def of_one(cls, make: MakeMethod, limits: Limits, pricing: Pricing | None = None) -> "TransitionFamily":
        """Create a family of one: turns at the maximum curvature and sharpness for all speeds.

        Args:
            make: Creates the method for a maximum curvature (1/m) and sharpness (1/m²).
            limits: Limits of the plan.
            pricing: The method's own pricing; None: transitions are timed one by one.
        """
        turn = limits.curvature_max_1pm, limits.sharpness_max_1pm2
        return cls(limits, (Turns(limits.drive.max_speed_mps, *turn, make(*turn)),), pricing=pricing)

    def speed_mps(self, end: CurveEnd) -> float:
        """Speed (m/s) at an end of a painted curve."""
        return min(self.limits.steady_speed_mps(end.curvature_1pm), end.speed_mps)

    def lead(self, turns: Turns, end: CurveEnd) -> Lead:
        """Lead out of a painted curve: empty or, before slower turns, a clothoid and a straight to brake on."""
        speed = self.speed_mps(end)
        slower = max(speed**2 - turns.speed_mps**2, 0.0)
        if not slower:
            return Lead((), end.curvature_1pm)
        sharpness = self.limits.turn_at(speed)[1]
        out = ContinuousDubins(self.limits.curvature_max_1pm, sharpness).lead_out(end.curvature_1pm)
        return Lead((*out, Piece(slower / (2.0 * BRAKING_SHARE * self.limits.acceleration_mps2))), 0.0)

    def widest(self, end: CurveEnd) -> Turns:
        """Turns of the lowest speed that does not slow down a painted curve."""
        speed = self.speed_mps(end)
        return min((t for t in self.turns if t.speed_mps >= speed), key=lambda t: t.speed_mps, default=self.turns[-1])

    def from_rest(self, start: PathPose, goal: CurveEnd, run_up_m: float) -> Transition:
        """Quickest path from standstill to a painted curve, over a straight of `run_up_m` before its lead-in."""
        into = self.widest(goal).method.lead_in(goal.curvature_1pm)
        pieces = (Piece(run_up_m), *into) if run_up_m else into
        reaching = CurveEnd(before(goal.pose, pieces), 0.0)
        transitions = []
        for turns in self.turns:
            path = PiecePath(start, joined((*turns.method.connect(start, reaching.pose), *pieces)))
            transitions.append(Transition(self.seconds(path.pieces, 0.0, self.speed_mps(goal)), path))
        return min(transitions, key=lambda each: each.seconds)

    def to_rest(self, start: CurveEnd, goal: PathPose, run_out_m: float) -> Transition:
        """Quickest path from a painted curve to standstill, over a straight of `run_out_m` after its lead-out."""
        out = self.widest(start).method.lead_out(start.curvature_1pm)
        pieces = (*out, Piece(run_out_m)) if run_out_m else out
        leaving = PiecePath(start.pose, pieces).end
        transitions = []
        for turns in self.turns:
            path = PiecePath(start.pose, joined((*pieces, *turns.method.connect(leaving, goal))))
            transitions.append(Transition(self.seconds(path.pieces, self.speed_mps(start), 0.0), path))
        return min(transitions, key=lambda each: each.seconds)

    def between(self, start: CurveEnd, goal: CurveEnd) -> list[Transition]:
        """All transitions from the end of one painted segment to the beginning of the next, the quickest first."""
        speeds = self.speed_mps(start), self.speed_mps(goal)
        transitions = [self._transition(turns, start, goal, speeds) for turns in self.turns]
        if self.standing:
            transitions += self._standing(start, goal, speeds)
        transitions.sort(key=lambda each: each.seconds)
        straight_on = extension(start, goal, transitions[0].path.length_m)
        if straight_on:
            transitions.insert(0, Transition(self.seconds(straight_on.pieces, *speeds), straight_on))
        return transitions

    def _transition(self, turns: Turns, start: CurveEnd, goal: CurveEnd, speeds: tuple[float, float]) -> Transition:
        out, into = self.lead(turns, start), from_goal(self.lead(turns, goal))
        leaving = CurveEnd(PiecePath(start.pose, out.pieces).end, out.curvature_1pm)
        reaching = CurveEnd(before(goal.pose, into.pieces), into.curvature_1pm)
        path = PiecePath(start.pose, joined((*out.pieces, *turns.method.between(leaving, reaching), *into.pieces)))
        return Transition(self.seconds(path.pieces, *speeds), path)

    def quickest_standing(self, start: CurveEnd, goal: CurveEnd, least_s: float) -> Transition | None:
        """Quickest transition with cusps or turns on the spot, if it takes less than `least_s`."""
        speeds = self.speed_mps(start), self.speed_mps(goal)
        if self.standing_bound_s(start, goal, speeds) >= least_s:
            return None
        transitions = [transition for transition in self._standing(start, goal, speeds) if transition.seconds < least_s]
        return min(transitions, key=lambda each: each.seconds, default=None)

    def standing_bound_s(self, start: CurveEnd, goal: CurveEnd, speeds: tuple[float, float]) -> float:
        """Lower bound (s) on the time of transitions with a standstill.

        The painted curves are extended, and the distance between the ends of the extensions is driven before the first
        standstill or after it; at best all on one side, since a longer run reaches a higher speed.
        """
        room = self.room_m(speeds)
        stop = start.pose.moved(arc_displacement(room, start.curvature_1pm), 0.0)
        go = goal.pose.moved(arc_displacement(-room, goal.curvature_1pm), 0.0)
        between = abs(go.point - stop.point)
        first, last = (self._from_rest_s(room, speed) for speed in speeds)
        further = [self._from_rest_s(room + between, speed) for speed in speeds]
        return min(first + further[1], further[0] + last)

    def _from_rest_s(self, length_m: float, speed_mps: float) -> float:
        """Minimum time (s) from standstill over a length to a speed, or from the speed to standstill."""
        gain = self.limits.acceleration_mps2
        fast = min(math.sqrt(gain * length_m + 0.5 * speed_mps**2), max(self.limits.transit_speed_mps, speed_mps))
        rest = length_m - (2.0 * fast**2 - speed_mps**2) / (2.0 * gain)
        return (2.0 * fast - speed_mps) / gain + max(rest, 0.0) / fast

    def room_m(self, speeds: Sequence[float]) -> float:
        """Distance (m) to brake before the first standstill, and to accelerate after the last."""
        return max(self.limits.stopping_distance_m(speed) for speed in speeds) / BRAKING_SHARE

    def _standing(self, start: CurveEnd, goal: CurveEnd, speeds: tuple[float, float]) -> list[Transition]:
        """Transitions with cusps and turns on the spot, between extensions of the painted curves to brake on.

        A robot that has to stop anyway gains nothing from wide turns: these are the tightest.
        """
        found = self.turns[0].method.standing_transitions(start, goal, self.room_m(speeds))
        return [Transition(self.seconds(p, *speeds), PiecePath(start.pose, p)) for p in found if self._may(p)]

    def _may(self, pieces: Sequence[Piece]) -> bool:
        backward, spinning = any(p.direction < 0 for p in pieces), any(p.spin_rad for p in pieces)
        return (not backward or REVERSING in self.standing) and (not spinning or SPINNING in self.standing)

    def seconds(self, pieces: Sequence[Piece], first_mps: float, last_mps: float) -> float:
        """Seconds for pieces that are entered and left at the given speeds (m/s)."""
        table: Floats = np.array(pieces, dtype=np.float64).reshape(-1, 5)
        return float(path_time(table, len(table), first_mps, last_mps, self.limits.caps)) if len(table) else 0.0


def from_goal(lead: Lead) -> Lead:
    """Lead driven into the curve instead of out of it."""
    back = tuple(p._replace(curvature_1pm=p.curvature_end_1pm, sharpness_1pm2=-p.sharpness_1pm2) for p in lead.pieces)
    return lead._replace(pieces=back[::-1])
