"""Bridges curves too short or too tight for a template by straight lines, within half a shortest line of them.

Walk along the curve with a stick as long as the shortest line. One end of it lies at v, within half a stick of where
the curve is; turn the other one towards the curve's first point p further from v than half a stick. What comes before p
is within half a stick of v, and the stick's other end within half a stick of p: so the walk can go on from there. Hence
along every curve, whatever hairpins, loops and dust it has, there is a walk that nowhere strays by more than half a
stick. It may as well turn towards a later point, reach out further than a stick to get there, or follow the curve
where that can be painted: of all such walks past points of the curve dynamic programming finds one that strays little.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from touchline.drawings.arc_columns import Complexes
from touchline.drawings.outline import Floats
from touchline.schemas.curves import Curve
from touchline.schemas.template import MIN_LENGTH_M

Indices = npt.NDArray[np.intp]

#: Longer than the shortest line, and half of that, by more than coordinates are rounded.
STICK_M = MIN_LENGTH_M * (1 + 1e-5)
STRAYS_M = STICK_M / 2 * (1 + 1e-5)
#: Lines that bridge reach at most about as far, and past this many points looked at.
LONGEST_M, MOST = 2 * STICK_M, 120
#: How far from what must be bridged the walk may leave the curve, at first.
REACH_M = 2 * STICK_M
#: Spacing of the points looked at: by length, and by turn on tight arcs.
STEP_M, STEP_RAD = 2e-3, 0.3
#: A walk of one line more must stray this much less.
LINE_M = 1e-3
#: Whether a walk stands on the curve, or off it at the end of a stick longer than the distance to the curve.
ON, OFF = 0, 1


def paintable(curve: Curve) -> bool:
    """Whether a template may hold it."""
    return curve.length_m >= MIN_LENGTH_M and abs(curve.curvature_1pm) * MIN_LENGTH_M <= 1.0


def without_slivers(curves: Sequence[Curve]) -> list[Curve]:
    """``curves``, with straight lines in the place and the neighbourhood of those that a template may not hold.

    Each then begins where the one before it ends, and the first one where it did. Neither is further from the other
    than half of `MIN_LENGTH_M`, and what a tight arc bulges between the points looked at, 0.1 mm at most. Empty if
    ``curves`` nowhere are further than that from where they begin.
    """
    if all(paintable(curve) for curve in curves):
        return list(curves)
    reach_m = REACH_M
    while (walk := _walk(_stations(curves, reach_m))) is None:
        # No way back to the curve so near. Where the walk may leave it everywhere there is one.
        reach_m *= 2
    return walk


@dataclass(frozen=True)
class _Stations:
    """Points at which a walk may leave the curves, and by which it is judged.

    Attributes:
        curves: What is walked along.
        first: (len(curves) + 1,) the station at which each begins, and the very last one.
        curve: (n,) the curve that each station is on, or begins; the last station has the last one's end.
        at_m: (n,) and how far along.
        points: (n,) m, x + iy.
        until: (n,) the last station before the next stretch that has none, and so must be followed.
    """

    curves: Sequence[Curve]
    first: Indices
    curve: Indices
    at_m: Floats
    points: Complexes
    until: Indices


@dataclass(frozen=True)
class _Steps:
    """What a walk may do next: to stations (m,), standing ON or OFF there (m,), at points (m,), at a cost (m,)."""

    to: Indices
    stands: Indices
    points: Complexes
    cost: Floats
    follows: bool


class _Walks:
    """The best walk to each station, ON the curve and OFF it: cost, end, where from, whether along the curve."""

    def __init__(self, stations: _Stations) -> None:
        count = len(stations.points)
        self.cost = np.full((count, 2), np.inf)
        self.points = np.column_stack((stations.points, stations.points))
        self.before = np.zeros((count, 2, 2), dtype=np.intp)
        self.follows = np.zeros((count, 2), dtype=bool)
        self.cost[0, ON] = 0.0

    def extend(self, i: int, stands: int, steps: _Steps) -> None:
        """Take the steps from station ``i`` that make a walk better."""
        cost = self.cost[i, stands] + steps.cost
        better = cost < self.cost[steps.to, steps.stands]
        where = steps.to[better], steps.stands[better]
        self.cost[where], self.points[where] = cost[better], steps.points[better]
        self.before[where], self.follows[where] = (i, stands), steps.follows


def _walk(stations: _Stations) -> list[Curve] | None:
    """The best walk from the first station to the last; None if there is none."""
    walks, last = _Walks(stations), len(stations.points) - 1
    for i, stands in product(range(last), (ON, OFF)):
        if np.isfinite(walks.cost[i, stands]):
            walks.extend(i, stands, _lines(stations, i, walks.points[i, stands]))
            walks.extend(i, stands, _rest(stations, i, walks.points[i, stands]))
            if stands == ON:
                walks.extend(i, ON, _following(stations, i))
    i, stands = last, int(np.argmin(walks.cost[last]))
    if not np.isfinite(walks.cost[i, stands]):
        return None
    walk: list[Curve] = []
    while i > 0:
        before, stood = (int(k) for k in walks.before[i, stands])
        start, end = walks.points[before, stood], walks.points[i, stands]
        if walks.follows[i, stands]:
            walk.append(_part(stations, before, i))
        elif start != end:
            walk.append(Curve.from_line((float(start.real), float(start.imag)), (float(end.real), float(end.imag))))
        i, stands = before, stood
    return walk[::-1]


def _lines(stations: _Stations, i: int, start: complex) -> _Steps:
    """Lines from ``start``, that stands for station ``i``, towards later ones."""
    ahead = _ahead(stations, i) - start
    away = np.abs(ahead)
    if away.max() > LONGEST_M:
        near = slice(int(np.argmax(away > LONGEST_M)) + 1)
        ahead, away = ahead[near], away[near]
    length = np.maximum(away, STICK_M)
    towards = ahead / np.maximum(away, 1e-12)
    # Rows: the stations passed; columns: the lines, each turned onto the real axis.
    passed = ahead[:, None] * towards.conj()
    off = np.abs(passed - np.clip(passed.real, 0.0, length))
    strays = np.maximum(np.maximum.accumulate(off).diagonal(), length - away)
    fit = np.flatnonzero(strays[1:] <= STRAYS_M) + 1
    stands = np.where(away[fit] >= STICK_M, ON, OFF)
    return _Steps(i + fit, stands, start + length[fit] * towards[fit], strays[fit] ** 4 + LINE_M**4, follows=False)


def _rest(stations: _Stations, i: int, start: complex) -> _Steps:
    """No line at all, as long as the curve stays near to ``start``."""
    away = np.maximum.accumulate(np.abs(_ahead(stations, i) - start))
    near = np.flatnonzero(away <= STRAYS_M)[1:][-1:]
    return _Steps(i + near, np.full(len(near), OFF), np.full(len(near), start), away[near] ** 4, follows=False)


def _ahead(stations: _Stations, i: int) -> Complexes:
    """The points (m,) of station ``i`` and of those to which one step may go."""
    return stations.points[i : min(stations.until[i], i + MOST) + 1]


def _following(stations: _Stations, i: int) -> _Steps:
    """The curve itself from station ``i`` on, as far as it goes."""
    long_enough = _lengths(stations, i) >= MIN_LENGTH_M
    to = i + 1 + np.flatnonzero(long_enough & paintable(stations.curves[stations.curve[i]]))
    return _Steps(to, np.full(len(to), ON), stations.points[to], np.zeros(len(to)), follows=True)


def _lengths(stations: _Stations, i: int) -> Floats:
    """(m,) distance from station ``i`` to the later ones of the same curve, m."""
    k = stations.curve[i]
    at = np.append(stations.at_m[i + 1 : stations.first[k + 1]], stations.curves[k].length_m)
    return np.asarray(at - stations.at_m[i])[: stations.first[k + 1] - i]


def _part(stations: _Stations, i: int, j: int) -> Curve:
    """What is between two stations of one curve."""
    curve: Curve = stations.curves[stations.curve[i]]
    x, y, heading, _ = (float(v) for v in curve.at(stations.at_m[i]))
    return replace(curve, x_m=x, y_m=y, heading_rad=heading, length_m=float(_lengths(stations, i)[j - i - 1]))


def _stations(curves: Sequence[Curve], reach_m: float) -> _Stations:
    """Stations within ``reach_m`` along the curves of those that must be bridged, else where one begins."""
    at: list[Floats] = []
    stops: list[int] = []
    first = [0]
    for curve, behind, ahead in zip(curves, _distances_m(curves), reversed(_distances_m(curves[::-1])), strict=True):
        head, tail = max(reach_m - behind, 0.0), max(reach_m - ahead, 0.0)
        step = min(STEP_M, STEP_RAD / max(abs(curve.curvature_1pm), STEP_RAD))
        if head + tail < curve.length_m:
            near = np.linspace(0.0, head, int(np.ceil(head / step)) + 1)
            far = np.linspace(curve.length_m - tail, curve.length_m, int(np.ceil(tail / step)) + 1)
            at.append(np.concatenate((near, far[:-1])))
            stops.append(first[-1] + len(near) - 1)
        else:
            at.append(np.linspace(0.0, curve.length_m, int(np.ceil(curve.length_m / step)) + 1)[:-1])
        first.append(first[-1] + len(at[-1]))
    stops.append(first[-1])
    ends = [curves[-1].end[:2]]
    points = np.concatenate([*(np.column_stack(c.at(s)[:2]) for c, s in zip(curves, at, strict=True)), ends])
    return _Stations(
        curves=curves,
        first=np.array(first),
        curve=np.append(np.repeat(np.arange(len(curves)), np.diff(first)), len(curves) - 1),
        at_m=np.append(np.concatenate(at), curves[-1].length_m),
        points=points[:, 0] + 1j * points[:, 1],
        until=np.array(stops)[np.searchsorted(stops, np.arange(first[-1] + 1))],
    )


def _distances_m(curves: Sequence[Curve]) -> list[float]:
    """How far along ``curves`` the beginning of each is from the last that must be bridged, m; 0 for such a one."""
    distances, distance = [], np.inf
    for curve in curves:
        distance = distance if paintable(curve) else 0.0
        distances.append(distance)
        distance += curve.length_m if paintable(curve) else 0.0
    return distances
