"""Transitions from one stroke to the next."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_raster import CoverageRaster
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.kernels.best_transition import survey
from touchline.services.planner.coverage.kernels.transition_candidates import Join
from touchline.services.planner.coverage.kernels.turn_pieces import SPUN, Mover, spun_between
from touchline.services.planner.coverage.wall_slide import WallSlide
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath, joined
from touchline.services.planner.steering.circles import circle
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline.services.planner.steering.words import words

# A word may begin and end this far (m) from the ends of its strokes; searched in coarse steps, then finely.
ZONE_M, COARSE_M, FINE_M = 12.0, 1.0, 0.25
# Words in the kernel's order.
WORDS = ("LSL", "LSR", "LRL", "LRL", "RSR", "RSL", "RLR", "RLR")
# Candidates that are examined after the best one so far.
PATIENCE = 250


@dataclass(frozen=True)
class StrokeTransition:
    """Transition from one stroke to the next; positions are distances along the strokes.

    Attributes:
        leave_m: End of the driven part of the first stroke.
        depart_m: Position at which it is left; less than `leave_m` after driving back.
        path: From the first stroke to the second.
        arrive_m: End of the path on the second stroke.
        begin_m: Beginning of the driven part of the second stroke; less than `arrive_m` after driving back.
        seconds: Time for the end zones and the path.
    """

    leave_m: float
    depart_m: float
    path: PiecePath
    arrive_m: float
    begin_m: float
    seconds: float


class Slides(NamedTuple):
    """Slides to the left between strokes of two directions, in the order of `Join.slides`.

    Attributes:
        pieces: Pieces of each.
        table: The same as an array.
        ends_m: (SLIDES, 2) end of each relative to its beginning.
    """

    pieces: list[tuple[Piece, ...]]
    table: Floats
    ends_m: Floats

    @classmethod
    def of(cls, slide: WallSlide, first: int, last: int) -> Self:
        """Make the slides off a stroke of one direction (±1) and onto one of another."""
        pieces = [
            slide.pieces(onward * direction, onto=onto)
            for onward in (-1, 1)
            for direction, onto in ((first, False), (last, True))
        ]
        ends = [PiecePath(PathPose(0.0, 0.0, 0.0), each).end[:2] for each in pieces]
        return cls(pieces, np.array(pieces, dtype=np.float64), np.array(ends))


class TransitionFinder:
    """Finds transitions, given the machine, its free space, and what the plan covers so far."""

    def __init__(self, space: FreeSpace, covered: CoverageRaster, seconds_per_m2: float, *, reversing: bool) -> None:
        """Price uncovered ground at `seconds_per_m2`."""
        machine = space.machine
        self.space, self.covered, self.seconds_per_m2, self.reversing = space, covered, seconds_per_m2, reversing
        self.slide = WallSlide.of(machine, space.swing_m)
        self.turn = ContinuousTurn(machine.curvature_max_1pm, machine.sharpness_max_1pm2)
        root = math.sqrt(machine.sharpness_max_1pm2)
        unit = circle(machine.curvature_max_1pm / root)
        driving = machine.speed_mps, machine.acceleration_mps2, machine.spin_lever_m, machine.bend_s_per_m
        self.mover = Mover(unit, root, *driving)
        self._slides = {(off, onto): Slides.of(self.slide, off, onto) for off in (1, -1) for onto in (1, -1)}
        self._shut: set[tuple[CoverStroke, CoverStroke, tuple[float, float], bool]] = set()
        """Strokes, with their zones, between which nothing is free, which does not depend on what is covered."""

    def best(
        self, first: CoverStroke, last: CoverStroke, first_from_m: float = 0.0, last_to_m: float = math.inf
    ) -> StrokeTransition | None:
        """Return the best transition, or None if the body touches something on all of them.

        The end zones of the strokes must be discounted before.

        Args:
            first: Stroke to leave.
            last: Stroke to join.
            first_from_m: Position on `first` from which it may be left.
            last_to_m: Position on `last` up to which it may be joined.
        """
        last_to_m = min(last_to_m, last.length_m)
        zone = self.zones(first, last, first_from_m, last_to_m)
        pair = first, last, zone, self.reversing
        if pair in self._shut:
            return None
        leaves = _places(first.length_m - np.arange(0.0, ZONE_M + COARSE_M, COARSE_M), first_from_m, first.length_m)
        joins = _places(np.arange(0.0, ZONE_M + COARSE_M, COARSE_M), 0.0, last_to_m)
        leave, join = self._leave(first, leaves), self._join(joins)
        found = self._survey(first, last, zone, leave, join)
        if found is None:
            self._shut.add(pair)
            return None
        best = self._laid(first, last, leave, join, found)
        if best is None:
            return None
        around = np.arange(-COARSE_M + FINE_M, COARSE_M, FINE_M)
        leaves = _places(best.depart_m + around, zone[0], first.length_m)
        joins = _places(best.arrive_m + around, 0.0, zone[1])
        leave = self._leave(first, leaves, back=best.leave_m > best.depart_m)
        join = self._join(joins, back=best.begin_m < best.arrive_m)
        found = self._survey(first, last, zone, leave, join)
        return (self._laid(first, last, leave, join, found) if found is not None else None) or best

    def zones(
        self, first: CoverStroke, last: CoverStroke, first_from_m: float, last_to_m: float
    ) -> tuple[float, float]:
        """Beginning of the first stroke's end zone and end of the last one's begin zone (m along each).

        Args:
            first: Stroke to leave.
            last: Stroke to join.
            first_from_m: Position on `first` from which it may be left.
            last_to_m: Position on `last` up to which it may be joined.
        """
        return max(first.length_m - ZONE_M, first_from_m), min(ZONE_M, last_to_m, last.length_m)

    def _leave(self, stroke: CoverStroke, places: Floats, back: bool | None = None) -> Floats:
        """Rows of `Join.leave`, with slides where the tail needs them beside a wall."""
        none, behind = np.zeros((len(places), 3)), stroke.length_m - places[places < stroke.length_m]
        there, last = np.column_stack((places, none)), np.full_like(behind, stroke.length_m)
        walled = stroke.kind in (DriveKind.LAP, DriveKind.SETTING_OUT) or self.slide.both
        sides = (-1.0, 0.0, 1.0) if walled else (0.0,)
        rows = [np.column_stack((last, behind, np.full_like(behind, side), none[: len(behind), 0])) for side in sides]
        if not self.slide.both:
            return _either(there, np.concatenate(rows), back, self.reversing)
        return np.concatenate((there, _onward(there), *(rows if self.reversing else ())))

    def _join(self, places: Floats, back: bool | None = None) -> Floats:
        """Rows of `Join.join`."""
        none = np.zeros((len(places), 3))
        there, returned = np.column_stack((places, places, none[:, :2])), np.column_stack((places, none))
        if not self.slide.both:
            return _either(there, returned[places > 0.0], back, self.reversing)
        slid = [returned + np.array((0.0, 0.0, side, 0.0)) for side in (-1.0, 1.0)]
        backward = (returned[places > 0.0], *slid) if self.reversing else ()
        return np.concatenate((there, _onward(there), *backward))

    def _survey(
        self, first: CoverStroke, last: CoverStroke, zone: tuple[float, float], leave: Floats, join: Floats
    ) -> list[float] | None:
        """Row of `survey`; None if nothing is free."""
        slides = self._slides[first.direction, last.direction]
        asked = Join(
            np.array(first.at(zone[0])),
            float(first.direction),
            leave - np.array((zone[0], 0.0, 0.0, 0.0)),
            slides.table,
            slides.ends_m,
            np.array(last.start),
            float(last.direction),
            zone[1],
            join,
            self.reversing,
            self.reversing and not (first.kind == last.kind == DriveKind.LANE),
        )
        best = survey(asked, self.space.walls, self.mover, self.covered.grid, self.seconds_per_m2, PATIENCE)
        return best.tolist() if math.isfinite(best[0]) else None

    def _laid(
        self, first: CoverStroke, last: CoverStroke, leave: Floats, join: Floats, found: list[float]
    ) -> StrokeTransition | None:
        """Transition of a row of `survey`; None if the body touches something on it, in full precision."""
        slides = self._slides[first.direction, last.direction].pieces
        _, seconds, _, i, j, direction, kind, first_rad = found
        leave_m, behind_m, side, off_on = leave[int(i)].tolist()
        arrive_m, begin_m, onto, onto_on = join[int(j)].tolist()
        off, on = _sideways(slides[2 * int(off_on)], side), _sideways(slides[1 + 2 * int(onto_on)], onto)
        back = [Piece(behind_m, direction=-first.direction)] if behind_m else []
        behind = PiecePath(first.at(leave_m), joined((*back, *off)))
        goal, slide_on = last.at(arrive_m), PiecePath(PathPose(0.0, 0.0, 0.0), on).end
        goal = goal.moved(-slide_on.point, 0.0)
        ends = behind.end, goal
        if int(kind) == SPUN:
            word = _spun(*ends, int(direction))
        else:
            word = self._word(ends, int(direction), WORDS[int(kind)], abs(first_rad))
        path = PiecePath(behind.start, (*behind.pieces, *word, *on))
        if self.space.touched(path):
            return None
        return StrokeTransition(leave_m, leave_m - behind_m, path, arrive_m, begin_m, seconds)

    def _word(
        self, ends: tuple[PathPose, PathPose], direction: int, letters: str, first_rad: float
    ) -> tuple[Piece, ...]:
        """Pieces of a word that the kernel found, in full precision; backward where the direction is −1."""
        about = 0.0 if direction > 0 else math.pi
        start, goal = (pose._replace(heading_rad=pose.heading_rad + about) for pose in ends)
        offers = words(start, goal, self.turn)
        alike = [word for word in offers if word.letters == letters]
        word = min(alike, key=lambda word: abs(math.remainder(word.amounts[0] - first_rad, math.tau)))
        pieces = word.pieces(self.turn)
        if direction < 0:
            pieces = tuple(Piece(p.length_m, -p.curvature_1pm, -p.sharpness_1pm2, -1) for p in pieces)
        return pieces


def _onward(there: Floats) -> Floats:
    """Copies of rows with slides to either side in the direction of travel."""
    return np.concatenate([there + np.array((0.0, 0.0, side, 1.0)) for side in (-1.0, 1.0)])


def _sideways(slide: tuple[Piece, ...], side: float) -> tuple[Piece, ...]:
    """Slide to the left for a positive side, to the right for a negative one, none for 0."""
    return () if side == 0.0 else slide if side > 0.0 else tuple(piece.mirrored() for piece in slide)


def _spun(start: PathPose, goal: PathPose, direction: int) -> tuple[Piece, ...]:
    """Pieces from one pose to another: turn on the spot, straight, turn on the spot."""
    (seen, heading), amounts = goal.seen_from(start), np.empty(3)
    spun_between(seen.real, seen.imag, heading, float(direction), amounts)
    first_rad, straight_m, last_rad = amounts.tolist()
    pieces = Piece(0.0, 0.0, 0.0, direction, first_rad), Piece(straight_m, direction=direction)
    return joined((*pieces, Piece(0.0, 0.0, 0.0, direction, last_rad)))


def _places(places: Floats, low: float, high: float) -> Floats:
    return np.unique(np.clip(places, low, high))


def _either(there: Floats, returned: Floats, back: bool | None, reversing: bool) -> Floats:
    if back is None:
        return np.concatenate((there, returned)) if reversing else there
    return returned if back and len(returned) else there
