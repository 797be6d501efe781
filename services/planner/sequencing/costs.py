"""The cost matrix of an ordering problem: seconds from every end to every beginning, and for painting."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from touchline.services.planner.budget import UNWATCHED, Watch
from touchline.services.planner.geometry.clothoid import Floats, Ints, Piece, PiecePath, Pose
from touchline.services.planner.sequencing.order import Problem
from touchline.services.planner.sequencing.way_times import HEADING, TRACK_PIECES, X, Y, way_times
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.steering.circles import LIMIT, circle
from touchline.services.planner.steering.method import CurveEnd, before
from touchline.services.planner.steering.word_lengths import word_lengths
from touchline.services.planner.swaths.chains import GAP_M
from touchline.services.planner.swaths.swaths import Painting, Swath
from touchline.services.planner.transitions.transitions import Turns, Ways, turned_round

# Every node's nearest neighbours are timed exactly; of the nearest of these, short hops, cusps and turns on the spot
# are tried as well.
TIMED, HOPPED = 12, 3
# Up to this many nodes all pairs are timed.
ALL_NODES = 200
# So many pairs take about 50 ms to time roughly, which is done when this share of all time has passed.
ROUGH_PART, ROUGH_DONE = 150_000, 0.15
# A segment is not painted twice, nor reached from itself.
NEVER_S = 1e6
# Pairs that differ by no more than rounding (m, rad, 1/m) take the same time.
ALIKE = 1e-7
ORIGIN = Pose(0.0, 0.0, 0.0)


class Timing(NamedTuple):
    """How pairs are timed: by words alone or with short `hops`, cusps and turns on the spot as well.

    A `part` of the pairs takes about 50 ms; behind each it may be enough. `begun` and `ended` are the shares of all
    time that have passed before and after it.
    """

    hops: bool
    part: int
    begun: float
    ended: float


WORDS, HOPS = Timing(False, 3000, ROUGH_DONE, 0.25), Timing(True, 120, 0.25, 1.0)


@dataclass(frozen=True)
class Tracks:
    """The quickest ways of a matrix.

    Attributes:
        paint_s: (nodes,) seconds that painting takes.
        kind: (ends, beginnings) which way, −1 where it has only been timed roughly.
        pieces: (ways, TRACK_PIECES, 5) the columns of `Piece`, from the end of the painted segment on.
        counts: (ways,) how many of them there are.
    """

    paint_s: Floats
    kind: Ints
    pieces: Floats
    counts: Ints

    def with_pairs(self, pairs: Ints, which: Ints, pieces: Floats, counts: Ints) -> "Tracks":
        """With these `pieces` and `counts` too, of which the pairs (n, 2) have those number `which` (n,)."""
        kind = self.kind.copy()
        kind[pairs[:, 0], pairs[:, 1]] = len(self.counts) + which
        return replace(
            self, kind=kind, pieces=np.concatenate((self.pieces, pieces)), counts=np.concatenate((self.counts, counts))
        )


def nodes_of(modes: Sequence[Sequence[Swath]]) -> tuple[list[Swath], Ints, Ints]:
    """All modes as nodes; which swath each paints; and its other way round (itself, if that cannot be driven)."""
    nodes = [swath for group in modes for swath in group]
    segment = np.repeat(np.arange(len(modes)), [len(group) for group in modes])
    flip = np.arange(len(nodes))
    first = 0
    for group in modes:
        for i, swath in enumerate(group):
            for k, other in enumerate(group):
                if _turned_round(swath, other):
                    flip[first + i] = first + k
        first += len(group)
    return nodes, segment, flip


def _turned_round(swath: Swath, other: Swath) -> bool:
    """Whether one of two modes of a swath is the other one the other way round."""
    first, last = swath.strokes[0], other.strokes[-1]
    x, y, _ = last.nozzle.end
    same = first.id == last.id and first.flipped != last.flipped
    return same and abs(complex(first.nozzle.x_m - x, first.nozzle.y_m - y)) < 1e-6


def problem(
    modes: Sequence[Sequence[Swath]],
    ways: Ways,
    painting: Painting,
    start: CurveEnd | None,
    end: CurveEnd | None = None,
    watch: Watch = UNWATCHED,
) -> tuple[Problem, Tracks]:
    """The ordering problem, and the ways behind it.

    Without a `start` every swath may come first, without an `end` every one last, at no cost. If the `watch` has
    enough early, the costs are rougher.
    """
    nodes, segment, flip = nodes_of(modes)
    count = len(nodes)
    begins, ends = [n.begin for n in nodes], [n.end for n in nodes]
    cost = np.full((count + 1, count + 1), 0.0)
    paint = np.array([node.seconds for node in nodes])
    cost[:-1, :-1], tracks = seconds_between(ends, begins, ways, segment, paint, watch)
    cost[:-1, :-1][segment[:, None] == segment[None, :]] = NEVER_S
    tracks = _going_on(nodes, painting, cost, tracks)
    if start is not None:
        cost[-1, :-1] = _timed_all([start], begins, ways)
    if end is not None:
        cost[:-1, -1] = _timed_all(ends, [end], ways)
    cost[:, :-1] += paint
    return Problem(cost, segment, flip), tracks


def _going_on(nodes: Sequence[Swath], painting: Painting, cost: Floats, tracks: Tracks) -> Tracks:
    """Lower the cost of going on from a swath into another to what painting both in one go takes longer."""
    places = [np.array([end.pose[:2] for end in each]) for each in ([n.end for n in nodes], [n.begin for n in nodes])]
    near = cKDTree(places[0]).query_ball_tree(cKDTree(places[1]), GAP_M)
    pairs = []
    for a, b in ((a, b) for a, found in enumerate(near) for b in found if cost[a, b] < NEVER_S):
        both = painting.in_one_go(nodes[a], nodes[b])
        longer_s = both.seconds - nodes[a].seconds - nodes[b].seconds if both else math.inf
        if longer_s < cost[a, b]:
            cost[a, b] = longer_s
            pairs.append((a, b))
    if not pairs:
        return tracks
    none = np.zeros((1, TRACK_PIECES, 5)), np.zeros(1, dtype=np.int64)
    return tracks.with_pairs(np.array(pairs), np.zeros(len(pairs), dtype=np.int64), *none)


def seconds_between(
    ends: list[CurveEnd], begins: list[CurveEnd], ways: Ways, segment: Ints, paint_s: Floats, watch: Watch
) -> tuple[Floats, Tracks]:
    """Seconds (ends, begins) of the quickest ways, rough ones for pairs that are far from each other; and the ways."""
    count = len(ends)
    none = np.zeros((0, TRACK_PIECES, 5)), np.zeros(0, dtype=np.int64)
    tracks = Tracks(paint_s, np.full((count, count), -1), *none)
    table = _straight(ends, begins, ways)
    if count <= ALL_NODES:
        pairs = _all_pairs(count, count)
    else:
        _rough(ends, begins, ways, table, watch)
        pairs = _nearest(table, segment, TIMED)
    for timing in (WORDS, HOPS):
        if timing.hops:
            pairs = _nearest(table, segment, HOPPED)
        chosen, seconds, which, pieces, counts = _timed(ends, begins, ways, pairs, timing, watch)
        done = pairs[chosen]
        table[done[:, 0], done[:, 1]] = seconds
        tracks = tracks.with_pairs(done, which, pieces, counts)
    return table, tracks


def _straight(ends: list[CurveEnd], begins: list[CurveEnd], ways: Ways) -> Floats:
    """Seconds straight on from each end to each beginning, whichever way they look."""
    starts, goals = _table(ends), _table(begins)
    apart = np.hypot(*(goals[None, :, axis] - starts[:, None, axis] for axis in (X, Y)))
    return np.asarray(apart / ways.limits.transit_speed_mps)


def _rough(ends: list[CurveEnd], begins: list[CurveEnd], ways: Ways, table: Floats, watch: Watch) -> None:
    """Seconds by the length of the words, with the turns driven at the speed that they are made for."""
    starts, goals = _table(ends), _table(begins)
    fast = ways.limits.transit_speed_mps
    for part in watch.parts(len(starts), max(ROUGH_PART // len(goals), 1), 0.0, ROUGH_DONE):
        tables = [
            word_lengths(
                starts[part],
                goals,
                turns.curvature_1pm,
                turns.sharpness_1pm2,
                turn_weight=max(fast / turns.speed_mps, 1.0),
            )
            for turns in ways.turns[1::2] or ways.turns
        ]
        table[part] = np.minimum.reduce(tables) / fast


def _nearest(table: Floats, segment: Ints, count: int) -> Ints:
    """The pairs of each end with its cheapest beginnings, and of each beginning with its cheapest ends."""
    open_ = np.where(segment[:, None] == segment[None, :], np.inf, table)
    count = min(count, len(table) - 1)
    if count < 1:
        return np.zeros((0, 2), dtype=np.int64)
    chosen = np.zeros(table.shape, dtype=bool)
    np.put_along_axis(chosen, np.argpartition(open_, count - 1, axis=1)[:, :count], True, axis=1)
    np.put_along_axis(chosen, np.argpartition(open_, count - 1, axis=0)[:count], True, axis=0)
    return np.argwhere(chosen & np.isfinite(open_))


def _all_pairs(starts: int, goals: int) -> Ints:
    return np.stack(np.divmod(np.arange(starts * goals), goals), axis=1)


def _timed_all(ends: list[CurveEnd], begins: list[CurveEnd], ways: Ways) -> Floats:
    """Seconds (n,) by words from one end to all beginnings, or from all ends to one beginning."""
    pairs = _all_pairs(len(ends), len(begins))
    return _timed(ends, begins, ways, pairs, WORDS, UNWATCHED)[1]


def _timed(
    ends: list[CurveEnd], begins: list[CurveEnd], ways: Ways, pairs: Ints, timing: Timing, watch: Watch
) -> tuple[Ints, Floats, Ints, Floats, Ints]:
    """Which (n,) of the `pairs` were timed before it was enough; seconds (n,) of the quickest way of each, and which.

    These ways are pieces (m, TRACK_PIECES, 5) and their number (m,): pairs that are alike but for their place have one.
    Cusps and turns on the spot compete as far as the robot drives them.
    """
    rows = way_rows(ends, begins, ways)
    first, alike = _alike(_table(ends)[pairs[:, 0]], _table(begins)[pairs[:, 1]])
    pairs = pairs[first]
    pieces, counts = np.zeros((len(pairs), TRACK_PIECES, 5)), np.zeros(len(pairs), dtype=np.int64)
    seconds, done = np.zeros(len(pairs)), 0
    for part in watch.parts(len(pairs), timing.part, timing.begun, timing.ended):
        seconds[part] = way_times(*rows, ways.limits.row, pairs[part], timing.hops, pieces[part], counts[part])
        done = part.stop
        if not (timing.hops and ways.standing):
            continue
        for i in range(part.start, part.stop):
            way = ways.quickest_standing(ends[pairs[i, 0]], begins[pairs[i, 1]], float(seconds[i]))
            if way:
                seconds[i], counts[i] = way.seconds, len(way.path.pieces)
                pieces[i, : counts[i]] = way.path.pieces
    chosen = np.flatnonzero(alike < done)
    which = alike[chosen]
    return chosen, seconds[which], which, pieces[:done], counts[:done]


def way_rows(ends: list[CurveEnd], begins: list[CurveEnd], ways: Ways) -> tuple[Floats, Floats, Floats, Floats]:
    """The starts, goals, circles and roots that `way_times` takes."""
    circles = [circle(t.curvature_1pm / t.sharpness_1pm2**0.5) for t in ways.turns]
    roots = np.array([t.sharpness_1pm2**0.5 for t in ways.turns])
    starts = np.array([_rows(ends, ways, *each, leaving=True) for each in zip(ways.turns, circles, strict=True)])
    goals = np.array([_rows(begins, ways, *each, leaving=False) for each in zip(ways.turns, circles, strict=True)])
    return starts, goals, np.array(circles), roots


def _table(ends: list[CurveEnd]) -> Floats:
    """(n, 5) x, y, heading, curvature and largest speed."""
    return np.array([(*end.pose, end.curvature_1pm, end.speed_mps) for end in ends])


def _alike(starts: Floats, goals: Floats) -> tuple[Ints, Ints]:
    """The first of the pairs (rows of both) that are the same but for their place; which of them each is like.

    Fields repeat themselves: of the pairs of an American football field one in ten is unlike all before it.
    """
    apart = (goals[:, 0] - starts[:, 0] + 1j * (goals[:, 1] - starts[:, 1])) * np.exp(-1j * starts[:, 2])
    turn = np.angle(np.exp(1j * (goals[:, 2] - starts[:, 2])))
    seen = np.column_stack((apart.real, apart.imag, turn, starts[:, 3:], goals[:, 3:]))
    grid = np.rint(seen / ALIKE).astype(np.int64)
    _, first, alike = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return first, alike.reshape(-1)


def _rows(ends: list[CurveEnd], ways: Ways, turns: Turns, figures: Floats, *, leaving: bool) -> Floats:
    """The rows of `way_times` for ends (or beginnings) with one kind of turn."""
    known: dict[tuple[float, float], tuple[float, ...]] = {}
    for end in ends:
        if end[1:] not in known:
            known[end[1:]] = _lead_row(end, ways, turns, figures, leaving=leaving)
    rows = np.array([known[end[1:]] for end in ends])
    poses = np.array([end.pose for end in ends])
    moved = (rows[:, X] + 1j * rows[:, Y]) * np.exp(1j * poses[:, 2])
    rows[:, X], rows[:, Y] = poses[:, 0] + moved.real, poses[:, 1] + moved.imag
    rows[:, HEADING] += poses[:, 2]
    return rows


def _lead_row(end: CurveEnd, ways: Ways, turns: Turns, figures: Floats, *, leaving: bool) -> tuple[float, ...]:
    """The row for an end like this at the origin."""
    lead = ways.lead(turns, end)
    if abs(lead.curvature_1pm) > figures[LIMIT] * turns.sharpness_1pm2**0.5:
        # Too tight for these turns to begin with: they begin where it is straight.
        words = ContinuousDubins(turns.curvature_1pm, turns.sharpness_1pm2)
        lead = lead._replace(pieces=words.lead_out(lead.curvature_1pm), curvature_1pm=0.0)
    pose = PiecePath(ORIGIN, lead.pieces).end if leaving else before(ORIGIN, turned_round(lead).pieces)
    bend: Piece | None = next((p for p in lead.pieces if p.sharpness_1pm2), None)
    straight = sum(p.length_m for p in lead.pieces if not p.sharpness_1pm2)
    painted, sharpness = (bend.curvature_1pm, abs(bend.sharpness_1pm2)) if bend else (0.0, 1.0)
    return *pose, lead.curvature_1pm, ways.speed_mps(end), painted, sharpness, straight
