"""Bridges of straight lines over curves too short or too tight for a template, within half a shortest line of them.

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

#: Length of a stick: the shortest line plus more than the rounding of coordinates; and half of it.
STICK_M = MIN_LENGTH_M * (1 + 1e-5)
STRAYS_M = STICK_M / 2 * (1 + 1e-5)
#: Approximate maximum length of bridging lines, and maximum number of samples that they pass.
LONGEST_M, MOST = 2 * STICK_M, 120
#: Initial distance from a sliver within which the walk may leave the curve.
REACH_M = 2 * STICK_M
#: Spacing of samples: by length, and by turn on tight arcs.
STEP_M, STEP_RAD = 2e-3, 0.3
#: Price of a line, as deviation (m).
LINE_M = 1e-3
#: State of a walk: on the curve, or off it at the end of a stick longer than the distance to the curve.
ON, OFF = 0, 1


def paintable(curve: Curve) -> bool:
    """True if a template may hold the curve."""
    return curve.length_m >= MIN_LENGTH_M and abs(curve.curvature_1pm) * MIN_LENGTH_M <= 1.0


def without_slivers(curves: Sequence[Curve]) -> list[Curve]:
    """Replace curves that a template may not hold, and their neighbourhood, by straight lines.

    The result is connected, and begins where ``curves`` do. The deviation in both directions is at most half of
    `MIN_LENGTH_M`, plus the bulge of tight arcs between samples, 0.1 mm at most. The result is empty if ``curves`` stay
    that close to their beginning.
    """
    if all(paintable(curve) for curve in curves):
        return list(curves)
    reach_m = REACH_M
    while (walk := _walk(_stations(curves, reach_m))) is None:
        # No walk within this reach returns to the curve; without a limit there is always one.
        reach_m *= 2
    return walk


@dataclass(frozen=True)
class _Stations:
    """Points at which a walk may leave the curves, and by which it is evaluated.

    Attributes:
        curves: Curves to walk along.
        first: (len(curves) + 1,) first station of each curve, and the last station.
        curve: (n,) curve of each station; the last station is at the end of the last curve.
        at_m: (n,) position along the curve.
        points: (n,) x + iy, m.
        until: (n,) last station before the next stretch without stations, which must be followed.
    """

    curves: Sequence[Curve]
    first: Indices
    curve: Indices
    at_m: Floats
    points: Complexes
    until: Indices


@dataclass(frozen=True)
class _Steps:
    """Next steps of a walk: target stations (m,), states ON or OFF (m,), points (m,) and costs (m,)."""

    to: Indices
    stands: Indices
    points: Complexes
    cost: Floats
    follows: bool


class _Walks:
    """Best walk to each station, ON the curve and OFF it: cost, end, predecessor, whether along the curve."""

    def __init__(self, stations: _Stations) -> None:
        count = len(stations.points)
        self.cost = np.full((count, 2), np.inf)
        self.points = np.column_stack((stations.points, stations.points))
        self.before = np.zeros((count, 2, 2), dtype=np.intp)
        self.follows = np.zeros((count, 2), dtype=bool)
        self.cost[0, ON] = 0.0

    def extend(self, i: int, stands: int, steps: _Steps) -> None:
        """Take the steps from station ``i`` that improve a walk."""
        cost = self.cost[i, stands] + steps.cost
        better = cost < self.cost[steps.to, steps.stands]
        where = steps.to[better], steps.stands[better]
        self.cost[where], self.points[where] = cost[better], steps.points[better]
        self.before[where], self.follows[where] = (i, stands), steps.follows


def _walk(stations: _Stations) -> list[Curve] | None:
    """Find the best walk from the first station to the last; None if there is none."""
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
    """Lines from ``start``, which represents station ``i``, towards later ones."""
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
    """Steps without a line, as long as the curve stays near to ``start``."""
    away = np.maximum.accumulate(np.abs(_ahead(stations, i) - start))
    near = np.flatnonzero(away <= STRAYS_M)[1:][-1:]
    return _Steps(i + near, np.full(len(near), OFF), np.full(len(near), start), away[near] ** 4, follows=False)


def _ahead(stations: _Stations, i: int) -> Complexes:
    """Points (m,) of station ``i`` and of those that one step can reach."""
    return stations.points[i : min(stations.until[i], i + MOST) + 1]


def _following(stations: _Stations, i: int) -> _Steps:
    """Steps along the curve itself from station ``i`` on."""
    long_enough = _lengths(stations, i) >= MIN_LENGTH_M
    to = i + 1 + np.flatnonzero(long_enough & paintable(stations.curves[stations.curve[i]]))
    return _Steps(to, np.full(len(to), ON), stations.points[to], np.zeros(len(to)), follows=True)


def _lengths(stations: _Stations, i: int) -> Floats:
    """Distances (m,) from station ``i`` to the later ones of the same curve, m."""
    k = stations.curve[i]
    at = np.append(stations.at_m[i + 1 : stations.first[k + 1]], stations.curves[k].length_m)
    return np.asarray(at - stations.at_m[i])[: stations.first[k + 1] - i]


def _part(stations: _Stations, i: int, j: int) -> Curve:
    """Part of a curve between two stations."""
    curve: Curve = stations.curves[stations.curve[i]]
    x, y, heading, _ = (float(v) for v in curve.at(stations.at_m[i]))
    return replace(curve, x_m=x, y_m=y, heading_rad=heading, length_m=float(_lengths(stations, i)[j - i - 1]))


def _stations(curves: Sequence[Curve], reach_m: float) -> _Stations:
    """Lay stations within ``reach_m`` of the curves that must be bridged, elsewhere at the beginning of curves."""
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
    """Distance (m) along ``curves`` of each one's beginning from the last that must be bridged; 0 for such a one."""
    distances, distance = [], np.inf
    for curve in curves:
        distance = distance if paintable(curve) else 0.0
        distances.append(distance)
        distance += curve.length_m if paintable(curve) else 0.0
    return distances
