"""Itinerary: run-in, transitions and run-out, free of collisions and, where worth the time, off wet paint."""

import math
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import tee
from typing import NamedTuple

import numpy as np

from touchline.services.planner.collision.checker import Collision, CollisionChecker
from touchline.services.planner.collision.via_poses import ClosedEnds, detours
from touchline.services.planner.collision.ways_round import WaysRound
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, Piece, PiecePath
from touchline.services.planner.sequencing.wet_paint import BEGUN, NO_LINES, SPEED, Wheels, wet_rows
from touchline.services.planner.steering.method import CurveEnd, before
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline.services.planner.swaths.offset import Stroke
from touchline.services.planner.swaths.swaths import Painting, Swath, parted
from touchline.services.planner.transitions.transitions import Lead, Transition, TransitionFamily, from_goal

# Straight before the first line (m): an estimator with an unknown heading finds it within a degree over 5 m.
RUN_IN_M = 5.0
# The robot comes to rest this far before the end of the run-out's straight.
RUN_OUT_SPARE_M = 0.1
# Time (s) of constant speed before the first line, so that the valve opens at the speed it was timed for.
STEADY_S = 0.5
# Turns (rad) of run-in and run-out where there is no room straight on.
BENDS_RAD = tuple(side * math.radians(angle) for angle in (45, 90, 135, 180) for side in (1, -1))
# Tolerance (m, rad, 1/m) within which pairs of ends have the same relative pose, and the same transitions.
ALIKE = 1e-11
# Times that differ by less are equal.
ROUNDING_S = 1e-9


class CheckedOffer(NamedTuple):
    """A transition on offer, and its collision, if it has one."""

    transition: Transition
    hit: Collision | None


class ItineraryLeg(NamedTuple):
    """Chosen transition, with its crossings of each line painted so far, and its collision if all offers collide.

    `others` is the number of crossings of wet lines of other robots.
    """

    path: PiecePath
    seconds: float
    crossings: Ints
    collision: Collision | None = None
    others: int = 0


@dataclass
class Itinerary:
    """Swaths in driving order, and the legs before, between and after them.

    `over` has for each stroke the number of crossings of each earlier one while it is painted; `over_others` is the
    number of crossings of wet lines of other robots by all strokes.
    """

    swaths: list[Swath]
    legs: list[ItineraryLeg] = field(default_factory=list)
    over: list[Ints] = field(default_factory=list)
    seconds: float = 0.0
    over_others: int = 0

    @cached_property
    def strokes(self) -> list[Stroke]:
        """Strokes of all swaths."""
        return [stroke for swath in self.swaths for stroke in swath.strokes]

    @property
    def wet_crossings(self) -> int:
        """Number of crossings of this robot's wet paint by its wheels and casters."""
        return int(sum(leg.crossings.sum() for leg in self.legs) + sum(each.sum() for each in self.over))

    @property
    def wet_others(self) -> int:
        """Number of crossings of other robots' wet paint by its wheels and casters."""
        return self.over_others + sum(leg.others for leg in self.legs)

    @property
    def blocked(self) -> list[int]:
        """Numbers of the legs that collide."""
        return [i for i, leg in enumerate(self.legs) if leg.collision]


@dataclass(frozen=True)
class ItineraryBuilder:
    """Builder of itineraries: chooses the quickest legs, with wet crossings at `crossing_s` each.

    The first leg leads from `start`, or from a straight before the first swath; the last to `end`, or, if the robot
    `returns`, to its start, or to a straight after the last swath. `others` are rows of lines of other robots.
    """

    transitions: TransitionFamily
    painting: Painting
    checker: CollisionChecker | None
    wheels: Wheels
    crossing_s: float
    start: PathPose | None
    end: PathPose | None = None
    returns: bool = False
    cache: dict[tuple[int, ...], list[Transition]] = field(default_factory=dict)
    closed: ClosedEnds = field(default_factory=ClosedEnds)
    looked_at: dict[tuple[CurveEnd, CurveEnd], Iterator[CheckedOffer]] = field(default_factory=dict)
    others: Floats = field(default_factory=lambda: NO_LINES)
    ways: WaysRound | None = None

    def drive(self, swaths: list[Swath]) -> Itinerary:
        """Build the itinerary along the swaths in this order."""
        swaths, going_on = self._in_one_go(swaths)
        drive = Itinerary(swaths)
        rows, done = wet_rows(stroke.nozzle for stroke in drive.strokes), 0
        for i, swath in enumerate(swaths):
            if going_on[i]:
                self._take(drive, ItineraryLeg(PiecePath(swath.begin.pose, ()), 0.0, np.zeros(done, dtype=np.int64)))
            else:
                offers = self._between(swaths[i - 1].end, swath.begin) if i else self.run_ins(swath.begin)
                self._take(drive, self.choose(offers, drive.seconds, rows[:done], in_turn=i == 0))
            for stroke, path in zip(swath.strokes, swath.paths, strict=True):
                seconds = path.length_m / swath.speed_mps
                drive.over.append(self.wheels.crossings(path, drive.seconds, seconds, rows[:done]))
                drive.over_others += self._over_others(path, drive.seconds, seconds)
                rows[done, BEGUN], rows[done, SPEED] = drive.seconds, stroke.nozzle.length_m / seconds
                drive.seconds += seconds
                done += 1
        end = drive.legs[0].path.start if self.returns else self.end
        offers = self.run_outs(swaths[-1].end, end)
        self._take(drive, self.choose(offers, drive.seconds, rows, in_turn=True))
        return drive

    def _in_one_go(self, swaths: list[Swath]) -> tuple[list[Swath], list[bool]]:
        """Join swaths where that is quicker than a transition; also return which of them continue the last one."""
        wholes, going_on = swaths[:1], [False]
        for swath in swaths[1:]:
            last = wholes[-1]
            both = self.painting.in_one_go(last, swath)
            longer_s = both.seconds - last.seconds - swath.seconds if both else math.inf
            # If it takes no longer, no transition is searched.
            joined = longer_s < ROUNDING_S or (both and longer_s < self._transitions(last.end, swath.begin)[0].seconds)
            going_on.append(bool(joined))
            wholes[-1:] = [both] if both and joined else [last, swath]
        return parted(wholes, swaths), going_on

    def choose(self, offers: Iterator[CheckedOffer], begun_s: float, painted: Floats, *, in_turn: bool) -> ItineraryLeg:
        """Choose the cheapest clear offer, or (`in_turn`) the first clear one; the first of all if all collide."""
        best: ItineraryLeg | None = None
        least, bump = math.inf, None
        for transition, hit in offers:
            if best and (in_turn or transition.seconds >= least):
                break
            if hit:
                bump = bump or ItineraryLeg(
                    transition.path, transition.seconds, np.zeros(len(painted), dtype=np.int64), hit
                )
                continue
            over = self.wheels.crossings(transition.path, begun_s, transition.seconds, painted)
            others = self._over_others(transition.path, begun_s, transition.seconds)
            if (cost := transition.seconds + self.crossing_s * float(over.sum() + others)) < least:
                best, least = ItineraryLeg(transition.path, transition.seconds, over, others=others), cost
        chosen = best or bump
        assert chosen  # there is at least one offer
        return chosen

    def _over_others(self, path: PiecePath, begun_s: float, seconds: float) -> int:
        """Number of crossings of wet lines of other robots on a path that is driven from `begun_s` on."""
        return int(self.wheels.crossings(path, begun_s, seconds, self.others).sum()) if len(self.others) else 0

    def _take(self, drive: Itinerary, leg: ItineraryLeg) -> None:
        drive.legs.append(leg)
        drive.seconds += leg.seconds

    def _looked_at(self, transitions: Iterable[Transition]) -> Iterator[CheckedOffer]:
        """Offers with their collisions."""
        for each in transitions:
            yield CheckedOffer(each, self.checker.collision(each.path) if self.checker else None)

    def _kept(self, start: CurveEnd, goal: CurveEnd, offers: Iterator[CheckedOffer]) -> Iterator[CheckedOffer]:
        """Offers between two ends that are made once, as far as they are asked for, and kept for the next time."""
        if (start, goal) not in self.looked_at:
            (self.looked_at[start, goal],) = tee(offers, 1)
        return copy(self.looked_at[start, goal])

    def _between(self, start: CurveEnd, goal: CurveEnd) -> Iterator[CheckedOffer]:
        """Transitions on offer, the quickest first, followed by detours if all of them collide."""
        direct = (
            transition._replace(path=PiecePath(start.pose, transition.path.pieces))
            for transition in self._transitions(start, goal)
        )
        if self.checker is None:
            return self._looked_at(direct)
        return self._kept(start, goal, self._with_detours(start, goal, self._looked_at(direct), self.checker))

    def _with_detours(
        self, start: CurveEnd, goal: CurveEnd, direct: Iterator[CheckedOffer], checker: CollisionChecker
    ) -> Iterator[CheckedOffer]:
        clear = False
        for offer in direct:
            clear |= offer.hit is None
            yield offer
        if not clear:
            yield from self._looked_at(detours(start, goal, self.transitions, checker, self.closed, self.ways))

    def collides(self, last: Swath | None, following: Swath | None) -> bool:
        """Return whether all offers between two swaths collide; None: those from the start, or to the end."""
        if last is not None and following is not None:
            offers = self._between(last.end, following.begin)
        elif following is not None:
            offers = self.run_ins(following.begin)
        else:
            assert last is not None, "a leg has a swath before or after it"
            offers = self.run_outs(last.end, self.end)
        return all(offer.hit for offer in offers)

    def _transitions(self, start: CurveEnd, goal: CurveEnd) -> list[Transition]:
        """Transitions between two ends of the same relative pose, the quickest first."""
        key = alike(start, goal)
        if key not in self.cache:
            self.cache[key] = self.transitions.between(start, goal)
        return self.cache[key]

    def run_ins(self, begin: CurveEnd) -> Iterator[CheckedOffer]:
        """Candidate run-ins: from the start pose or, without one, straights and bends before the first line."""
        if self.start is None or self.checker is None:
            return self._looked_at(self._run_ins(begin))
        return self._kept(CurveEnd(self.start, 0.0, 0.0), begin, self._looked_at(self._run_ins(begin)))

    def _run_ins(self, begin: CurveEnd) -> Iterator[Transition]:
        speed = self.transitions.speed_mps(begin)
        run_up = self.transitions.limits.stopping_distance_m(speed) + STEADY_S * speed
        if self.start is not None:
            direct = self.transitions.from_rest(self.start, begin, 0.0)
            yield direct if direct.path.length_m >= run_up else self.transitions.from_rest(self.start, begin, run_up)
            if self.checker:
                standing = CurveEnd(self.start, 0.0, 0.0)
                yield from detours(standing, begin, self.transitions, self.checker, self.closed, self.ways)
            return
        into = self.transitions.widest(begin).method.lead_in(begin.curvature_1pm)
        for pieces in self._runs(into, RUN_IN_M, run_up, begin):
            path = PiecePath(before(begin.pose, pieces), pieces)
            yield Transition(self.transitions.seconds(pieces, 0.0, speed), path)

    @property
    def run_out_m(self) -> float:
        """Length (m) of the straight after a last line that is painted at paint speed."""
        return self.transitions.limits.stopping_distance_m(self.transitions.limits.paint_speed_mps) + RUN_OUT_SPARE_M

    def run_outs(self, end: CurveEnd, goal: PathPose | None) -> Iterator[CheckedOffer]:
        """Candidate run-outs: to the goal or, without one, straights and bends after the last line."""
        if goal is None or self.checker is None:
            return self._looked_at(self._run_outs(end, goal))
        return self._kept(end, CurveEnd(goal, 0.0, 0.0), self._looked_at(self._run_outs(end, goal)))

    def _run_outs(self, end: CurveEnd, goal: PathPose | None) -> Iterator[Transition]:
        speed = self.transitions.speed_mps(end)
        length = self.transitions.limits.stopping_distance_m(speed) + RUN_OUT_SPARE_M
        if goal is not None:
            direct = self.transitions.to_rest(end, goal, 0.0)
            yield direct if direct.path.length_m >= length else self.transitions.to_rest(end, goal, length)
            if self.checker:
                yield from detours(
                    end, CurveEnd(goal, 0.0, 0.0), self.transitions, self.checker, self.closed, self.ways
                )
            return
        out = self.transitions.widest(end).method.lead_out(end.curvature_1pm)
        back = from_goal(Lead(out, 0.0)).pieces
        for pieces in self._runs(back, length, self.transitions.room_m((speed,)), end):
            turned = from_goal(Lead(pieces, 0.0)).pieces
            yield Transition(self.transitions.seconds(turned, speed, 0.0), PiecePath(end.pose, turned))

    def _runs(
        self, into: Sequence[Piece], length_m: float, least_m: float, at: CurveEnd
    ) -> Iterator[tuple[Piece, ...]]:
        """Candidate pieces before `into`: a straight and, where there are outlines, also shorter ones with bends."""
        yield (Piece(length_m), *into)
        if self.checker is None:
            return
        if least_m < length_m:
            yield (Piece(least_m), *into)
        turns = self.transitions.widest(at)
        turn = ContinuousTurn(turns.curvature_1pm, turns.sharpness_1pm2)
        for angle in BENDS_RAD:
            pieces = turn.pieces(abs(angle))
            yield (Piece(least_m), *(pieces if angle > 0.0 else (p.mirrored() for p in pieces)), *into)


def alike(start: CurveEnd, goal: CurveEnd) -> tuple[int, ...]:
    """Key of pairs of ends with the same relative pose, as many on a field have."""
    apart, turn = goal.pose.seen_from(start.pose)
    turned = math.remainder(turn, math.tau)
    values = (apart.real, apart.imag, turned, *start[1:], *goal[1:])
    return tuple(round(value / ALIKE) for value in values)
