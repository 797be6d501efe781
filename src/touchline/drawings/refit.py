"""Fit of as few lines and arcs as possible to a chain of them, tangent to one another where the drawing allows it.

A chain of lines and arcs is cut at some of its joints; between two of these comes one line, one arc, a biarc, or two
lines that meet in a corner. Of all such curves that stay within the tolerance, dynamic programming finds the one of the
least cost: of pieces, corners, short and tight pieces, and of deviation. The cost is the same for the reversed chain
and for its mirror image. Long lines and arcs of the drawing are kept.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from touchline.drawings.arc_columns import (
    COINCIDENT_M,
    COLUMNS,
    Bools,
    Complexes,
    arriving,
    biarcs,
    columns,
    curves_of,
    distances,
    leaving,
    lines,
    through,
)
from touchline.drawings.detail import Detail
from touchline.drawings.outline import Floats
from touchline.drawings.welding import welded
from touchline.schemas.curves import Curve, along, wrap_angle
from touchline.schemas.vehicles import Vehicle

Indices = npt.NDArray[np.intp]

#: A joint that turns by less is no corner that was meant, if the tolerance allows to make it tangent: coordinates of
#: two digits turn the short handles of a curve by as much. One that turns by no more than the second is tangent.
SOFT_RAD, TANGENT_RAD = 0.3, 1e-6
#: Size of dust, as a fraction of the tolerance.
DUST_SHARE = 0.1
#: What a corner, a piece of no length between corners, such a one between others, and one of no radius cost, in
#: pieces; straying by the tolerance costs one, by a share of it the share's square.
CORNER, SHORT, SHORT_SMOOTH, TIGHT, CRAMPED = 1.5, 1.5, 0.3, 0.5, 1.5
#: Arcs tighter than the nozzle's lateral offset can be painted in one direction only.
EASY_RADIUS_M = abs(Vehicle().tool.nozzle_y_m)
#: Multiple of the smallest feature from which something is no feature any more.
FEATURES = 5.0
#: Maximum samples of a piece, their minimum spacing as a fraction of the tolerance, and maximum samples in all.
POINTS, SPACING_SHARE, MOST_POINTS = 6, 0.5, 240
#: Samples of the first check, which most pieces fail, and pieces per batch of the full check.
FEW_POINTS, AT_ONCE = 8, 200
#: Joints that are processed in one batch.
BATCH = 64
#: Joints ahead in the first block, which doubles and finally gets gaps, and maximum.
FIRST_BLOCK, MOST_AHEAD = 6, 180
#: In chains of more pieces, joints closer to each other than this fraction of the smallest feature are skipped.
MANY, CLOSE_SHARE = 300, 0.25
STEEPEST_RAD = 0.9 * np.pi
#: Fraction of the tolerance that a piece may use at the samples.
STRICT_SHARE = 0.9


def refit(drawn: Sequence[Curve], exact: Sequence[bool], closed: bool, detail: Detail) -> list[Curve]:
    """Reduce a chain to as few lines and arcs as possible, within the tolerances of ``detail``.

    Args:
        drawn: Connected lines and arcs.
        exact: For each, whether it is drawn, or approximates another curve.
        closed: Whether the last one ends where the first one begins.
        detail: Tolerances.
    """
    known = {curve for curve, is_exact in zip(drawn, exact, strict=True) if is_exact}
    curves = welded(drawn, closed, DUST_SHARE * detail.tolerance_m)
    if not curves:
        return []
    chain = _Chain.of(curves, [curve in known for curve in curves], closed, detail)
    if all(chain.kept):
        return curves
    chain = chain.split(detail).rotated()
    found: list[Curve] = []
    for begin, end in chain.runs():
        found += [chain.curves[begin]] if chain.kept[begin] else _Fitter(chain, begin, end, detail).best()
    return _merged(found, closed)


@dataclass(frozen=True)
class _Chain:
    """Connected curves, flags of those that are kept, and the turn of each from the one before (rad).

    The first turn of an open chain is infinite.
    """

    curves: list[Curve]
    kept: list[bool]
    turns: list[float]
    closed: bool

    @classmethod
    def of(cls, curves: list[Curve], exact: list[bool], closed: bool, detail: Detail) -> "_Chain":
        turns = [_turn(curves[k - 1], curve) for k, curve in enumerate(curves)]
        if not closed:
            turns[0] = np.inf
        chain = cls(curves, exact, turns, closed)
        return replace(chain, kept=[ok and chain._stays(k, detail) for k, ok in enumerate(exact)])

    def turn_at(self, joint: int) -> float:
        """Turn (rad) at the beginning of a curve, or at the chain's end."""
        return self.turns[joint % len(self.turns)]

    def _stays(self, k: int, detail: Detail) -> bool:
        curve = self.curves[k]
        if curve.length_m < detail.feature_m:
            return False
        if curve.curvature_1pm:
            tight = abs(curve.curvature_1pm) * detail.feature_m / 2 > 1.0
            return not tight and not any(TANGENT_RAD < abs(self.turn_at(j)) <= SOFT_RAD for j in (k, k + 1))
        before, after = self._is_flattened(k, detail), self._is_flattened(k + 1, detail)
        if not (before or after):
            return True
        if before and after:
            return False
        # The last chord of a flattened curve, or a straight line that ends in one.
        neighbour = self.curves[k - 1] if before else self.curves[(k + 1) % len(self.curves)]
        return curve.length_m > 2 * neighbour.length_m

    def _is_flattened(self, joint: int, detail: Detail) -> bool:
        """True if the lines that meet there may as well be chords of a smooth curve."""
        first, second = self.curves[joint % len(self.curves) - 1], self.curves[joint % len(self.curves)]
        turn = abs(self.turn_at(joint))
        if first.curvature_1pm or second.curvature_1pm or not TANGENT_RAD < turn <= SOFT_RAD:
            return False
        return min(first.length_m, second.length_m) * turn / 8 <= detail.tolerance_m

    def is_soft(self, joint: int) -> bool:
        return abs(self.turn_at(joint)) <= SOFT_RAD

    def heading(self, joint: int) -> float:
        """Common heading of a soft joint: of the line or arc that is kept, else between both."""
        before, after = joint % len(self.curves) - 1, joint % len(self.curves)
        if self.kept[after] and not self.kept[before]:
            return self.curves[after].heading_rad
        end = self.curves[before].end[2]
        return end if self.kept[before] else end + self.turn_at(joint) / 2

    def split(self, detail: Detail) -> "_Chain":
        """Add joints at which a line could be left for a corner, or an arc for its heading."""
        curves, kept, turns = [], [], []
        for k, curve in enumerate(self.curves):
            head, tail = self._cuts(k, detail)
            stations = [0.0, *([head] if head else []), *([curve.length_m - tail] if tail else []), curve.length_m]
            for begin, end in pairwise(stations):
                x, y, heading, _ = (float(v) for v in curve.at(begin))
                whole = len(stations) == 2
                curves.append(
                    curve if whole else replace(curve, x_m=x, y_m=y, heading_rad=heading, length_m=end - begin)
                )
                middle = begin >= head and end <= curve.length_m - tail + COINCIDENT_M
                kept.append(self.kept[k] and middle)
                turns.append(self.turns[k] if begin == 0.0 else 0.0)
        return _Chain(curves, kept, turns, self.closed)

    def _cuts(self, k: int, detail: Detail) -> tuple[float, float]:
        curve, count = self.curves[k], len(self.curves)
        cuts = []
        for joint, other in ((k, k - 1), (k + 1, (k + 1) % count)):
            turn, ends = abs(self.turn_at(joint)), not self.closed and joint in (0, count)
            cut = 0.0
            if not ends and self.kept[k]:
                if curve.curvature_1pm == 0.0 and turn > SOFT_RAD and not self.kept[other]:
                    cut = detail.feature_m
            elif not ends and TANGENT_RAD < turn <= SOFT_RAD:
                cut = 3 * detail.tolerance_m / turn
            cuts.append(cut if cut < curve.length_m / 3 else 0.0)
        return cuts[0], cuts[1]

    def rotated(self) -> "_Chain":
        """Rotate a closed chain to begin at a curve that is kept, or at a corner."""
        if not self.closed:
            return self
        count = len(self.curves)
        begins = [k for k in range(count) if self.kept[k - 1] and not self.kept[k]]
        begins += [k for k in range(count) if not self.is_soft(k)]
        at = begins[0] if begins else 0
        curves, kept, turns = self.curves, self.kept, self.turns
        return _Chain(curves[at:] + curves[:at], kept[at:] + kept[:at], turns[at:] + turns[:at], self.closed)

    def runs(self) -> Iterator[tuple[int, int]]:
        """Intervals (first, end) of each curve that is kept, and of each stretch between."""
        begin = 0
        while begin < len(self.curves):
            end = begin + 1
            while not self.kept[begin] and end < len(self.curves) and not self.kept[end]:
                end += 1
            yield begin, end
            begin = end


class _Fitter:
    """Search for the best pieces along the curves ``begin`` to ``end`` of a chain."""

    def __init__(self, chain: _Chain, begin: int, end: int, detail: Detail) -> None:
        self.detail = detail
        self.rows = columns(chain.curves[begin:end])
        self.ends_m = np.concatenate(([0.0], np.cumsum(self.rows[:, 4])))
        counts = np.clip(np.ceil(self.rows[:, 4] / (SPACING_SHARE * detail.tolerance_m)), 1, POINTS).astype(np.intp)
        self.first_sample = np.concatenate(([0], np.cumsum(counts)))
        owner = np.repeat(np.arange(len(self.rows)), counts)
        share = (np.arange(len(owner)) - self.first_sample[owner] + 1) / counts[owner]
        self.samples = _points_along(self.rows[owner], self.rows[owner, 4] * share)
        points = np.append(self.rows[:, 0] + 1j * self.rows[:, 1], self.samples[-1])
        joints = range(begin, end + 1)
        nodes = self._nodes(np.array([chain.is_soft(k) for k in joints]))
        self.piece = nodes
        self.points = points[nodes]
        self.soft = np.array([chain.is_soft(begin + k) for k in nodes])
        self.turned = np.array([abs(chain.turn_at(begin + k)) > TANGENT_RAD for k in nodes]) & self.soft
        heading = [chain.heading(begin + k) if soft else 0.0 for k, soft in zip(nodes, self.soft, strict=True)]
        tangents = np.exp(1j * np.array(heading))
        leave = np.exp(1j * self.rows[np.minimum(nodes, len(self.rows) - 1), 2])
        arrive = np.exp(1j * (self.rows[:, 2] + self.rows[:, 3] * self.rows[:, 4]))[np.maximum(nodes - 1, 0)]
        self.leave = np.where(self.soft, tangents, leave)
        self.arrive = np.where(self.soft, tangents, arrive)

    def _nodes(self, soft: Bools) -> np.ndarray:
        """Joints at which the chain may be cut."""
        count = len(soft)
        if count <= MANY:
            return np.arange(count)
        least, nodes = CLOSE_SHARE * self.detail.feature_m, [0]
        for k in range(1, count - 1):
            far = self.ends_m[k] - self.ends_m[nodes[-1]]
            if far >= least or (not soft[k] and far >= least / 4):
                nodes.append(k)
        return np.array([*nodes, count - 1])

    def best(self) -> list[Curve]:
        count = len(self.points)
        cost, before = np.full(count, np.inf), np.zeros(count, dtype=np.intp)
        chosen: list[Floats] = [np.zeros(0)] * count
        cost[0] = 0.0
        for begin in range(0, count - 1, BATCH):
            nodes = np.arange(begin, min(begin + BATCH, count - 1))
            for i, offers in zip(nodes.tolist(), self._offers(nodes), strict=True):
                self._offer(cost, before, chosen, i, np.array([i + 1]), self._as_drawn(i))
                for ahead, costs, rows in offers:
                    self._offer(cost, before, chosen, i, ahead, (costs, rows))
        found, j = [], count - 1
        while j > 0:
            found.append(chosen[j])
            j = before[j]
        return [curve for rows in reversed(found) for curve in curves_of(rows)]

    def _offers(self, nodes: Indices) -> list[list[tuple[Indices, Floats, list[Floats]]]]:
        """Find the pieces with their costs from joints (n,) to the joints ahead, block by block.

        The pieces from a joint do not depend on those before it, so that many joints are processed at once.
        """
        found: list[list[tuple[Indices, Floats, list[Floats]]]] = [[] for _ in nodes]
        going, off, block = np.arange(len(nodes)), 1, FIRST_BLOCK
        while len(going) and off < MOST_AHEAD:
            ahead = nodes[going, None] + np.arange(off, off + block, max(1, block // (2 * FIRST_BLOCK)))
            there = ahead < len(self.points)
            which = np.nonzero(there)[0]
            costs, rows = self._pieces(nodes[going[which]], ahead[there])
            good = np.isfinite(costs)
            ends = np.searchsorted(which[good], np.arange(len(going) + 1)).tolist()
            to, costs, rows = ahead[there][good], costs[good], rows[good]
            for k, (first, last) in zip(going.tolist(), pairwise(ends), strict=True):
                if first < last:
                    found[k].append((to[first:last], costs[first:last], list(rows[first:last])))
            going = going[np.diff(ends) > 0]
            off, block = off + block, 2 * block
        return found

    def _offer(
        self,
        cost: Floats,
        before: np.ndarray,
        chosen: list[Floats],
        i: int,
        ahead: Indices,
        offers: tuple[Floats, list[Floats]],
    ) -> None:
        corner = np.where(self.soft[ahead] | (ahead == len(self.points) - 1), 0.0, CORNER)
        total = cost[i] + offers[0] + corner
        for k in np.flatnonzero(total < cost[ahead]):
            cost[ahead[k]], before[ahead[k]], chosen[ahead[k]] = total[k], i, offers[1][k]

    def _as_drawn(self, i: int) -> tuple[Floats, list[Floats]]:
        """Drawn pieces to the next joint, and their costs."""
        rows = self.rows[self.piece[i] : self.piece[i + 1]]
        corners = CORNER * (int(self.turned[i]) + int(self.turned[i + 1]) + len(rows) - 1)
        alone = not (self.soft[i] or self.soft[i + 1])
        return np.array([self._cost(rows[None], np.array([alone]))[0] + corners]), [rows]

    def _cost(self, rows: Floats, alone: Bools) -> Floats:
        """Costs (n,) of pieces (n, k, 5) without deviation."""
        length, radius = rows[..., 4], 1.0 / np.maximum(np.abs(rows[..., 3]), 1e-9)
        short = np.maximum(1.0 - length / self.detail.feature_m, 0.0) * np.where(alone, SHORT, SHORT_SMOOTH)[:, None]
        tight = TIGHT * np.maximum(1.0 - radius / EASY_RADIUS_M, 0.0)
        cramped = CRAMPED * (radius < self.detail.feature_m / 2)
        return np.asarray(np.where(length > 0.0, 1.0 + short + tight + cramped, 0.0).sum(axis=1))

    def _pieces(self, i: Indices, j: Indices) -> tuple[Floats, Floats]:
        """Cheapest one or two pieces (n, 2, 5) from joints (n,) to later ones (n,), costs (n,), infinite if none."""
        start, end, leave, arrive = self.points[i], self.points[j], self.leave[i], self.arrive[j]
        along_m = self.ends_m[self.piece[j]] - self.ends_m[self.piece[i]]
        soft, free, apart = self.soft[i], self.soft[j], np.abs(end - start) > COINCIDENT_M
        small = along_m <= FEATURES * self.detail.feature_m
        offers = [
            _Offer(biarcs, (start, leave, end, arrive), np.ones(len(i), dtype=np.bool_)),
            _Offer(_one_arc(leaving), (start, leave, end), soft & apart & ~free),
            _Offer(_one_arc(arriving), (start, end, arrive), ~soft & apart & free),
            _Offer(_one_arc(lines), (start, end), ~soft & apart & ~free),
            _Offer(_one_arc(through), (start, self._middles(i, j), end), ~soft & apart & ~free),
            _Offer(_corners, (start, leave, end, arrive), small),
        ]
        costs, pieces = np.full((len(offers), len(i)), np.inf), np.zeros((len(offers), len(i), 2, COLUMNS))
        for kind, offer in enumerate(offers):
            pairs, rows = offer.made()
            turns, lengths = np.abs(rows[..., 3] * rows[..., 4]).max(axis=1), rows[..., 4].sum(axis=1)
            good = (turns <= STEEPEST_RAD) & (lengths <= 1.05 * along_m[pairs] + 2 * self.detail.tolerance_m)
            pairs, rows = pairs[good], rows[good]
            allowed = np.where(small[pairs], self.detail.stray_m, STRICT_SHARE * self.detail.tolerance_m)
            stray = self._stray(i[pairs], j[pairs], rows, allowed)
            share = stray / self.detail.tolerance_m
            cost = self._cost(rows, ~free[pairs] & ~soft[pairs]) + CORNER * (offer.make is _corners)
            costs[kind, pairs] = cost + np.where(share <= 1.0, share**2, 2.0 * share - 1.0)
            pieces[kind, pairs] = rows
        cheapest = costs.argmin(axis=0), np.arange(len(i))
        return costs[cheapest], pieces[cheapest]

    def _middles(self, i: Indices, j: Indices) -> Complexes:
        """Points (n,) half way between joints."""
        half = (self.ends_m[self.piece[j]] + self.ends_m[self.piece[i]]) / 2
        k = np.clip(np.searchsorted(self.ends_m, half, side="right") - 1, 0, len(self.rows) - 1)
        return _points_along(self.rows[k], half - self.ends_m[k])

    def _stray(self, i: Indices, j: Indices, rows: Floats, allowed_m: Floats) -> Floats:
        """Maximum deviations (n,) of the chain from pieces (n, 2, 5) between joints, m; infinite beyond the allowed."""
        first, stop = self.first_sample[self.piece[i]], self.first_sample[self.piece[j]]
        stride = (stop - first) // MOST_POINTS + 1
        count = -((first - stop) // stride)
        strays = np.full(len(rows), np.inf)
        # A few points rule out most pieces.
        few = first[:, None] + stride[:, None] * (np.arange(FEW_POINTS) * count[:, None] // FEW_POINTS)
        near = np.flatnonzero(_away(self.samples[few], rows) <= allowed_m)
        near = near[np.argsort(count[near], kind="stable")]
        for some in np.array_split(near, len(near) // AT_ONCE + 1):
            at = np.minimum(np.arange(count[some].max(initial=1)), count[some, None] - 1)
            away = _away(self.samples[first[some, None] + stride[some, None] * at], rows[some])
            strays[some] = np.where(away <= allowed_m[some], away, np.inf)
        return strays


@dataclass(frozen=True)
class _Offer:
    """Kind of piece: its constructor, the arguments for every pair of joints, and the pairs (n,) that it fits."""

    make: Callable[..., tuple[Floats, Bools]]
    given: tuple[Complexes, ...]
    fits: Bools

    def made(self) -> tuple[Indices, Floats]:
        """Pairs (m,) for which there is such a piece, and the pieces (m, 2, 5)."""
        pairs = np.flatnonzero(self.fits)
        rows, good = self.make(*(each[pairs] for each in self.given))
        return pairs[good], rows[good]


def _one_arc(make: Callable[..., Floats]) -> Callable[..., tuple[Floats, Bools]]:
    """Extend pieces (n, 5) to (n, 2, 5), each followed by an empty one."""

    def made(*given: Complexes) -> tuple[Floats, Bools]:
        rows = make(*given)
        return np.stack((rows, np.zeros_like(rows)), axis=1), np.ones(len(rows), dtype=np.bool_)

    return made


def _away(points: Complexes, rows: Floats) -> Floats:
    """Maximum distances (n,) of points (n, m) from pieces (n, 2, 5), m."""
    away = distances(points, rows[:, :1])
    second = rows[:, 1, 4] > 0.0
    if second.any():
        away[second] = np.minimum(away[second], distances(points[second], rows[second, 1:]))
    return np.asarray(away.max(axis=1))


def _corners(start: Complexes, leave: Complexes, end: Complexes, arrive: Complexes) -> tuple[Floats, Bools]:
    """Two lines (n, 2, 5) along the tangents, and whether they meet in a corner (n,)."""
    v, turn = end - start, (leave.conj() * arrive).imag
    safe = np.where(np.abs(turn) > np.sin(SOFT_RAD) / 2, turn, 1.0)
    first, second = (v.conj() * arrive).imag / safe, (leave.conj() * v).imag / safe
    tip = start + first * leave
    good = (safe == turn) & (np.minimum(first, second) > COINCIDENT_M)
    return np.stack((lines(start, tip), lines(tip, end)), axis=1), good


def _points_along(rows: Floats, s_m: Floats) -> Complexes:
    """Points (n,) of pieces (n, 5) at arc lengths (n,), m."""
    x, y, _, _ = along(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], s_m)
    return np.asarray(x + 1j * y)


def _turn(first: Curve, second: Curve) -> float:
    return wrap_angle(second.heading_rad - first.end[2])


def _merged(curves: list[Curve], closed: bool) -> list[Curve]:
    """Merge neighbouring pieces of the same line or arc."""
    if closed and len(curves) > 1:  # begun at a joint, if there is one
        at = next((k for k in range(len(curves)) if _one(curves[k - 1], curves[k]) is None), 0)
        curves = curves[at:] + curves[:at]
    found: list[Curve] = []
    for curve in curves:
        joined = _one(found[-1], curve) if found else None
        found[-1:] = [joined] if joined else [*found[-1:], curve]
    return found


def _one(first: Curve, second: Curve) -> Curve | None:
    """Merge two curves, if they are of the same line or arc."""
    if abs(_turn(first, second)) > 1e-9:
        return None
    if first.curvature_1pm == second.curvature_1pm == 0.0:
        return Curve.from_line((first.x_m, first.y_m), second.end[:2])
    same = abs(first.curvature_1pm - second.curvature_1pm) <= 1e-9 * abs(first.curvature_1pm)
    if not same or abs(first.curvature_1pm) * (first.length_m + second.length_m) > np.pi:
        return None
    return replace(first, length_m=first.length_m + second.length_m)
