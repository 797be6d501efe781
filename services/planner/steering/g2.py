"""Method `g2`: shortest curvature-continuous path between any two poses and curvatures."""

import cmath
import math
from collections.abc import Callable

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath, joined
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.steering.circles import circle
from touchline.services.planner.steering.construct import MAX_PIECES, forward_pieces
from touchline.services.planner.steering.method import CurveEnd, before
from touchline.services.planner.steering.query import Query
from touchline.services.planner.steering.reversing import MAX_CUSPS, STRETCH_MIN_M, Shortest, shortest_reversing

# Turns on the spot up to this angle count as none.
ROUNDING_RAD = 1e-12
# A goal this close to the start (m, rad) is at the start, and needs no loop.
SAME = 1e-9

Find = Callable[[CurveEnd, CurveEnd], list[tuple[Piece, ...]]]


class Steering:
    """Transitions within a maximum curvature (1/m) and a maximum sharpness (1/m²), from curvature to curvature."""

    name = "g2"

    def __init__(self, curvature_max_1pm: float, sharpness_max_1pm2: float) -> None:
        self.words = ContinuousDubins(curvature_max_1pm, sharpness_max_1pm2)
        self.root = math.sqrt(sharpness_max_1pm2)
        self.circle: Floats = circle(curvature_max_1pm / self.root)
        self.curvature_cap_1pm = self.words.turn.curvature

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Clothoid from straight to `curvature_1pm`."""
        return self.words.lead_in(curvature_1pm)

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Clothoid from `curvature_1pm` to straight."""
        return self.words.lead_out(curvature_1pm)

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        """Shortest forward path between poses, straight at both ends."""
        return self.between(CurveEnd(start, 0.0), CurveEnd(goal, 0.0))

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """Shortest forward path between two curvatures."""
        return self._capped(start, goal, self._forward)[0]

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        """Shortest path for every number of cusps, and paths with turns on the spot.

        The painted curves are extended by `room_m` up to the first and from the last standstill, to brake and to
        accelerate.
        """
        run_out, run_in = Piece(room_m, start.curvature_1pm), Piece(room_m, goal.curvature_1pm)
        stop = CurveEnd(PiecePath(start.pose, (run_out,)).end, start.curvature_1pm)
        go = CurveEnd(before(goal.pose, (run_in,)), goal.curvature_1pm)
        standing = [*self._capped(stop, go, self._reversing), *turns_on_the_spot(stop, go)]
        return [joined((run_out, *path, run_in)) for path in standing]

    def _capped(self, start: CurveEnd, goal: CurveEnd, find: Find) -> list[tuple[Piece, ...]]:
        """Paths that `find` finds, with ramps at the ends whose curvature exceeds the cap.

        Where κ_max²/σ_max exceeds π, transitions keep to a smaller curvature than painted curves may have: the cap.
        """
        out_of, k_from = self._ramp_to_cap(start.curvature_1pm)
        back_into, k_to = self._ramp_to_cap(goal.curvature_1pm)
        into = tuple(Piece(p.length_m, p.curvature_end_1pm, -p.sharpness_1pm2) for p in reversed(back_into))
        leaving = CurveEnd(PiecePath(start.pose, out_of).end, k_from)
        reaching = CurveEnd(before(goal.pose, into), k_to)
        return [joined((*out_of, *path, *into)) for path in find(leaving, reaching)]

    def _forward(self, start: CurveEnd, goal: CurveEnd) -> list[tuple[Piece, ...]]:
        if start.curvature_1pm == goal.curvature_1pm == 0.0 and _same(start.pose, goal.pose):
            return [()]
        table = np.empty((MAX_PIECES, 4))
        count = forward_pieces(self._query(start, goal), table)
        return [self._pieces(table[:count])]

    def _reversing(self, start: CurveEnd, goal: CurveEnd) -> list[tuple[Piece, ...]]:
        many = MAX_CUSPS + 1
        found = Shortest(np.empty(many), np.empty((many, MAX_PIECES, 4)), np.zeros(many, dtype=np.int64))
        shortest_reversing(self._query(start, goal), STRETCH_MIN_M * self.root, found)
        paths, shortest = [], math.inf
        for length, table, count in zip(found.lengths.tolist(), found.paths, found.counts.tolist(), strict=True):
            if length < shortest:
                shortest = length
                paths.append(self._pieces(table[:count]))
        return paths

    def _query(self, start: CurveEnd, goal: CurveEnd) -> Query:
        """Express the goal in the frame of the start, in units of unit sharpness."""
        z, turn = goal.pose.seen_from(start.pose)
        ends = np.array([start.curvature_1pm, goal.curvature_1pm]) / self.root
        return Query(ends, z * self.root, math.remainder(turn, math.tau), self.circle)

    def _ramp_to_cap(self, curvature_1pm: float) -> tuple[tuple[Piece, ...], float]:
        """Clothoid from a curvature down to the cap, and the curvature (1/m) after it."""
        capped = math.copysign(min(abs(curvature_1pm), self.curvature_cap_1pm), curvature_1pm)
        if capped == curvature_1pm:
            return (), curvature_1pm
        sharpness = math.copysign(self.words.sharpness_max_1pm2, -curvature_1pm)
        return (Piece((capped - curvature_1pm) / sharpness, curvature_1pm, sharpness),), capped

    def _pieces(self, table: Floats) -> tuple[Piece, ...]:
        """Convert pieces (see construct.py) to metres."""
        # The conversion must not round a curvature at the limit to above it.
        cap = self.curvature_cap_1pm
        return tuple(
            Piece(
                length / self.root,
                min(max(k * self.root, -cap), cap),
                sharpness * self.words.sharpness_max_1pm2,
                int(direction),
            )
            for length, k, sharpness, direction in table.tolist()
        )


def turns_on_the_spot(start: CurveEnd, goal: CurveEnd) -> list[tuple[Piece, ...]]:
    """Paths of turn on the spot, straight, turn on the spot: forward, and backward.

    A path is left out if it would step in curvature where it neither turns on the spot nor changes direction, or if
    the straight is too short to drive.
    """
    z, turn = goal.pose.seen_from(start.pose)
    if 0.0 < abs(z) < STRETCH_MIN_M:
        return []
    if not z:
        spin = _turn(turn)
        smooth = spin or start.curvature_1pm == goal.curvature_1pm
        return [joined((Piece.spin(spin),))] if smooth else []
    paths = []
    for direction in (1, -1):
        first = _turn(cmath.phase(direction * z))
        last = _turn(turn - first)
        smooth = (first or not start.curvature_1pm) and (last or not goal.curvature_1pm)
        if smooth or direction < 0:
            paths.append(joined((Piece.spin(first), Piece(abs(z), direction=direction), Piece.spin(last))))
    return paths


def _turn(angle_rad: float) -> float:
    """Wrap an angle to (−π, π]; 0 where it is a rounding error."""
    turn = math.remainder(angle_rad, math.tau)
    return turn if abs(turn) > ROUNDING_RAD else 0.0


def _same(start: PathPose, goal: PathPose) -> bool:
    """True if two poses differ by rounding errors only."""
    z, turn = goal.seen_from(start)
    return max(abs(z), abs(math.remainder(turn, math.tau))) < SAME
