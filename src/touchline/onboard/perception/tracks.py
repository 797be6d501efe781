"""Tracks of things that the plan does not know, from scan to scan: place, velocity, kind and outline.

Constant velocity with white acceleration, a Kalman filter of each axis with the same variances (Y. Bar-Shalom, X. R. Li
and T. Kirubarajan, Estimation with Applications to Tracking and Navigation, Wiley 2001, section 6.2.2), and the global
nearest neighbour of each track within its gate. Tracks are for people and planning; protection uses hits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.core.records import Record
from touchline.onboard.perception.clusters import DIRECTIONS, LEG_M, STEP_M, UNIT, Clusters, widths_of
from touchline.onboard.perception.clusters import MOST as MOST_CLUSTERS
from touchline.onboard.perception.track_assignment import assign

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST: Final = 128
"""Largest number of tracks."""
THING: Final = "thing"
PERSON: Final = "person"
POST: Final = "post"
WALL: Final = "wall"
KINDS: Final = (THING, PERSON, POST, WALL)

_ACCELERATION: Final = 1.0
"""Spectral density of the white acceleration, m²/s³."""
_FIX_M: Final = 0.1
"""σ of a cluster's centre: a person's legs swing, whatever the lidar's noise."""
_LEG_FIX_M: Final = 0.3
"""The same if only one leg of a person is seen."""
_STRIDING: Final = 0.2
"""Share of scans with two legs from which on a track is a person's."""
_WIDTH_SHARE: Final = 0.3
"""σ of the centre as a share of the width, of things wider than a person: only a part of them is seen."""
_PERSON_M: Final = 0.8
_GATE: Final = 13.8
"""χ² of 2 degrees of freedom, 99.9 %."""
_FASTEST_MPS: Final = 3.0
"""σ of a new track's velocity."""
_LOST_S: Final = 1.0
_TENTATIVE_SCANS: Final = 2
_MOVING_MPS: Final = 0.3
_ANCHOR_S: Final = 0.5
"""Time between the places from which a track's motion is measured."""
_FORGOTTEN: Final = 0.02
"""Share by which an extreme point that is seen no more nears the present one in a scan."""
_WIDEST_M: Final = 3.0
"""Width up to which a standing thing keeps the sides that it has shown."""
_WALL_M: Final = 1.5
_WALL_SHARE: Final = 0.25
_POST_M: Final = 0.3


class TrackState(Record):
    """A track; times are of measurements."""

    number: int
    """From 1; 0: no track."""
    seen: int
    """Number of scans in which it was seen."""
    missed: int
    """Number of scans since."""
    time_s: float
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    place_var: float
    """Variances of an axis, m², m²/s, m²/s²: this and the next two."""
    both_var: float
    speed_var: float
    anchors: Annotated[Floats, 2, 4]
    """Time, place and its variance half a second ago, and before that."""
    moving: bool
    moved: bool
    """True if it has ever been seen to move."""
    width_m: float
    thickness_m: float
    legs: float
    """Share of the last scans in which two legs were seen."""
    hull_m: Annotated[Floats, DIRECTIONS, 2]


class TrackedThing(NamedTuple):
    """A thing that the plan does not know.

    Attributes:
        kind: One of `KINDS`, by size and motion.
        number: Number of its own, from 1.
        moving: True if it moves.
        x_m: Place, map frame, with `y_m`.
        y_m: Its other coordinate.
        place_sigma_m: σ of the place along an axis.
        vx_mps: Velocity, map frame, with `vy_mps`.
        vy_mps: Its other component.
        speed_sigma_mps: σ of the velocity along an axis.
        seen_s: Time at which it was last seen.
        outline_m: (DIRECTIONS, 2) convex outline, map frame, grown by a margin.
    """

    kind: str
    number: int
    moving: bool
    x_m: float
    y_m: float
    place_sigma_m: float
    vx_mps: float
    vy_mps: float
    speed_sigma_mps: float
    seen_s: float
    outline_m: Floats


class _Work(NamedTuple):
    """Memory of `follow`.

    Attributes:
        cost: (MOST, columns) costs of the assignment; `row_of`, `prices` and `way` are its memory, see `assign`.
        rows: (MOST,) places of the tracks in use.
        seen: (MOST_CLUSTERS, 5) of each cluster x, y, time, and the variance if it is a thing, or of a person.
        unit: (DIRECTIONS, 2) unit vectors.
    """

    cost: Floats
    row_of: Integers
    prices: Floats
    way: Integers
    rows: Integers
    seen: Floats
    unit: Floats


@kernel
def _cluster_var(clusters: Clusters, n: int, striding: bool, error_m: float) -> float:
    """Variance of a cluster's centre along an axis [m²].

    Args:
        clusters: Clusters of a scan.
        n: The cluster.
        striding: True if its track is a person's, of whom it may be one leg.
        error_m: σ of the robot's place along an axis.
    """
    width = clusters.width_m[n, 0]
    fix = _LEG_FIX_M if striding and clusters.legs[n] == 1 and width <= LEG_M else _FIX_M
    part = _WIDTH_SHARE * width if width > _PERSON_M else 0.0
    return fix * fix + part * part + error_m * error_m


@kernel
def _astray(track: TrackState, x: float, y: float, time_s: float) -> tuple[float, float, float]:
    """Return how far a place is from where a track is expected then, on both axes [m], and the time since its last."""
    after_s = max(time_s - track.time_s, 0.0)
    return x - track.x_m - after_s * track.vx_mps, y - track.y_m - after_s * track.vy_mps, after_s


@kernel
def _predicted_var(track: TrackState, after_s: float) -> float:
    """Variance of a track's place along an axis after a time [m²]."""
    noise = _ACCELERATION * after_s**3 / 3.0
    var: float = track.place_var + 2.0 * after_s * track.both_var + after_s * after_s * track.speed_var + noise
    return var


@kernel
def _cost(track: TrackState, seen: Floats) -> float:
    """Return the squared distance of a cluster from a track in units of its variance, at most the gate.

    Args:
        track: The track.
        seen: (5,) x, y, time, and the variance of a thing and of a person there; a row of `_Work.seen`.
    """
    x, y, after_s = _astray(track, seen[0], seen[1], seen[2])
    var = _predicted_var(track, after_s) + (seen[4] if track.legs > _STRIDING else seen[3])
    cost: float = min((x * x + y * y) / var, _GATE)
    return cost


@kernel
def _update(track: TrackState, seen: Floats, clusters: Clusters, n: int, unit: Floats) -> None:
    """Update a track by its cluster; `seen` as in `_cost`."""
    dx, dy, after_s = _astray(track, seen[0], seen[1], seen[2])
    place_var = _predicted_var(track, after_s)
    both_var = track.both_var + after_s * track.speed_var + 0.5 * _ACCELERATION * after_s * after_s
    speed_var = track.speed_var + _ACCELERATION * after_s
    gain = 1.0 / (place_var + (seen[4] if track.legs > _STRIDING else seen[3]))
    x, y = track.x_m + after_s * track.vx_mps, track.y_m + after_s * track.vy_mps
    track.x_m, track.y_m = x + gain * place_var * dx, y + gain * place_var * dy
    track.vx_mps, track.vy_mps = track.vx_mps + gain * both_var * dx, track.vy_mps + gain * both_var * dy
    track.place_var = place_var - gain * place_var * place_var
    track.both_var = both_var - gain * place_var * both_var
    track.speed_var = speed_var - gain * both_var * both_var
    track.time_s = max(seen[2], track.time_s)
    track.seen, track.missed = track.seen + 1, 0
    track.legs += 0.2 * ((1.0 if clusters.legs[n] == 2 else 0.0) - track.legs)
    _evaluate_motion(track, clusters.width_m[n, 0], clusters.width_m[n, 1])
    _take_hull(track, clusters.hull_m[n], unit)


@kernel
def _evaluate_motion(track: TrackState, width_m: float, thickness_m: float) -> None:
    """Decide whether a track moves, by its way in the last half to whole second."""
    then = track.anchors[1]
    way = math.hypot(track.x_m - then[1], track.y_m - then[2])
    sure = 3.0 * math.sqrt(track.place_var + then[3])
    wall = width_m >= _WALL_M and thickness_m <= _WALL_SHARE * width_m  # its visible part moves with the robot
    track.moving = not wall and way > max(sure, _MOVING_MPS * (track.time_s - then[0]))
    track.moved = track.moved or track.moving
    if track.time_s - track.anchors[0, 0] >= _ANCHOR_S:
        for k in range(4):
            track.anchors[1, k] = track.anchors[0, k]
        _anchor(track.anchors[0], track)


@kernel
def _anchor(anchor: Floats, track: TrackState) -> None:
    anchor[0], anchor[1], anchor[2], anchor[3] = track.time_s, track.x_m, track.y_m, track.place_var


@kernel
def _take_hull(track: TrackState, hull: Floats, unit: Floats) -> None:
    """Take in the visible side of a thing that stands; of one that moves, or is wide, only this side is kept."""
    if not track.moving and track.width_m <= _WIDEST_M:
        for k in range(DIRECTIONS):
            beyond = (track.hull_m[k, 0] - hull[k, 0]) * unit[k, 0] + (track.hull_m[k, 1] - hull[k, 1]) * unit[k, 1]
            kept = 1.0 - _FORGOTTEN if beyond > 0.0 else 0.0
            for axis in range(2):
                track.hull_m[k, axis] = hull[k, axis] + kept * (track.hull_m[k, axis] - hull[k, axis])
    else:
        for k in range(DIRECTIONS):
            track.hull_m[k, 0], track.hull_m[k, 1] = hull[k, 0], hull[k, 1]
    track.width_m, track.thickness_m = widths_of(track.hull_m, unit)


@kernel
def _bear(track: TrackState, number: int, seen: Floats, clusters: Clusters, n: int) -> None:
    """Begin a track with a cluster."""
    track.number, track.seen, track.missed = number, 1, 0
    track.x_m, track.y_m, track.time_s = seen[0], seen[1], seen[2]
    track.vx_mps = track.vy_mps = 0.0
    track.place_var = seen[3]
    track.both_var, track.speed_var = 0.0, _FASTEST_MPS * _FASTEST_MPS
    track.moving = track.moved = False
    track.width_m, track.thickness_m = clusters.width_m[n, 0], clusters.width_m[n, 1]
    track.legs = 1.0 if clusters.legs[n] == 2 else 0.0
    _anchor(track.anchors[0], track)
    _anchor(track.anchors[1], track)
    for k in range(DIRECTIONS):
        track.hull_m[k, 0], track.hull_m[k, 1] = clusters.hull_m[n, k, 0], clusters.hull_m[n, k, 1]


@kernel
def _is_at_a_person(seen: Floats, tracks: Sequence[TrackState], rows: Integers) -> bool:
    """Return whether a place is within a step of a person who was seen in this scan.

    Args:
        seen: The place, as in `_cost`.
        tracks: (MOST,) tracks.
        rows: (n,) places of those in use.
    """
    for r in rows:
        track = tracks[r]
        if track.legs > _STRIDING and track.missed == 0:
            x, y, _ = _astray(track, seen[0], seen[1], seen[2])
            if math.hypot(x, y) <= STEP_M:
                return True
    return False


@borrowing
def follow(
    clusters: Clusters, error_m: float, now_s: float, tracks: Sequence[TrackState], work: _Work, numbers: Integers
) -> int:
    """Assign a scan's clusters to tracks, update these, begin new ones, and end those that were lost.

    Args:
        clusters: Clusters of the scan.
        error_m: σ of the robot's place along an axis.
        now_s: Present time.
        tracks: (MOST,) tracks; changed.
        work: Memory.
        numbers: (1,) number of the last new track; changed.

    Returns:
        Number of tracks that were in use before or were begun.
    """
    rows, row_of, seen, used, found = work.rows, work.row_of, work.seen, 0, clusters.found[0]
    for k in range(len(tracks)):
        if tracks[k].number != 0:
            rows[used] = k
            used += 1
    # A column at the cost of the gate stands for "not seen"; there are as many as are needed for every track.
    columns = max(found, used)
    for n in range(found):
        seen[n, 0], seen[n, 1], seen[n, 2] = clusters.centre_m[n, 0], clusters.centre_m[n, 1], clusters.time_s[n]
        seen[n, 3] = _cluster_var(clusters, n, False, error_m)
        seen[n, 4] = _cluster_var(clusters, n, True, error_m)
    for r in range(used):
        for n in range(columns):
            work.cost[r, n] = _cost(tracks[rows[r]], seen[n]) if n < found else _GATE
    assign(work.cost, used, columns, row_of, work.prices, work.way)
    for r in range(used):
        tracks[rows[r]].missed += 1
    for n in range(found):
        r = row_of[n + 1] - 1
        if r >= 0 and work.cost[r, n] < _GATE:
            _update(tracks[rows[r]], seen[n], clusters, n, work.unit)
            row_of[n + 1] = -1
    free, first = 0, numbers[0]
    for n in range(found):
        # The other leg of a person, or a part of a walking one between the last beam and the first, is nobody else.
        part = clusters.width_m[n, 0] <= _PERSON_M
        if row_of[n + 1] >= 0 and not (part and _is_at_a_person(seen[n], tracks, rows[:used])):
            while free < len(tracks) and tracks[free].number != 0:
                free += 1
            if free < len(tracks):
                numbers[0] += 1
                _bear(tracks[free], numbers[0], seen[n], clusters, n)
    for r in range(used):
        track = tracks[rows[r]]
        tentative = track.seen == 1 and track.missed >= _TENTATIVE_SCANS
        if tentative or now_s - track.time_s > _LOST_S:
            track.number = 0
    return used + int(numbers[0] - first)


class Tracks:
    """Tracks of all unknown things.

    Attributes:
        none: True if there is certainly no track.
    """

    def __init__(self) -> None:
        self.none = True
        self._rows = np.zeros(MOST, TrackState.dtype)
        columns = max(MOST, MOST_CLUSTERS) + 1
        cost, prices, seen = np.zeros((MOST, columns)), np.zeros((4, columns)), np.zeros((MOST_CLUSTERS, 5))
        row_of, way, rows = (np.zeros(size, np.int64) for size in (columns, columns, MOST))
        self._work, self._numbers = _Work(cost, row_of, prices, way, rows, seen, UNIT), np.zeros(1, np.int64)

    def follow(self, clusters: Clusters, error_m: float, now_s: float) -> None:
        """Take the clusters of a scan.

        Args:
            clusters: The clusters.
            error_m: σ of the robot's place along an axis.
            now_s: Present time.
        """
        rows = cast("Sequence[TrackState]", self._rows)
        self.none = not follow(clusters, error_m, now_s, rows, self._work, self._numbers)

    def at(self, now_s: float, margin_m: float) -> list[TrackedThing]:
        """Return the tracks that were seen at least twice, as they are expected to be now.

        Args:
            now_s: Present time.
            margin_m: Margin of their outlines.
        """
        rows = self._rows[(self._rows["number"] > 0) & (self._rows["seen"] > 1)]
        after_s = np.maximum(now_s - rows["time_s"], 0.0)
        way = np.stack((rows["vx_mps"], rows["vy_mps"]), -1) * after_s[:, None]
        x, y = rows["x_m"] + way[:, 0], rows["y_m"] + way[:, 1]
        place_sigma = np.sqrt(_predicted_var.py_func(rows.view(np.recarray), after_s))
        speed_sigma = np.sqrt(rows["speed_var"] + _ACCELERATION * after_s)
        grown = margin_m / math.cos(math.pi / DIRECTIONS) * UNIT
        outlines = rows["hull_m"] + grown + np.where(rows["moving"][:, None, None], way[:, None, :], 0.0)
        columns = (
            rows["number"],
            rows["moving"],
            x,
            y,
            place_sigma,
            rows["vx_mps"],
            rows["vy_mps"],
            speed_sigma,
            rows["time_s"],
        )
        values = zip(*(each.tolist() for each in columns), strict=True)
        kinds = map(_kind_of, *(rows[name].tolist() for name in ("width_m", "thickness_m", "moved", "legs")))
        return [
            TrackedThing._make((kind, *each, outline))
            for kind, each, outline in zip(kinds, values, outlines, strict=True)
        ]


def _kind_of(width_m: float, thickness_m: float, moved: bool, legs: float) -> str:
    if width_m >= _WALL_M and thickness_m <= _WALL_SHARE * width_m:
        return WALL
    if width_m <= _PERSON_M and (moved or legs > 0.5):
        return PERSON
    return POST if width_m <= _POST_M else THING
