"""Statistics of fixes against dead reckoning: lateral wander, slip, scatter and jumps.

All are of a dead-reckoned antenna and of the fixes at the same times. Robust standard deviations are 1.4826 times the
median distance from the median, so that a few jumps do not decide.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_NORMAL: Final = 1.4826
"""Standard deviation of normal numbers over the median distance from their median."""
_GAP_STEPS: Final = 3.0
_LEAST_FIXES: Final = 4
_LEAST_WINDOWS: Final = 10
_STARTS: Final = 10
_STRAIGHT: Final = 0.98


class MatchedTrack(NamedTuple):
    """Fixes and dead reckoning at the same times.

    Attributes:
        time_s: (k,) times of the fixes.
        fixes_m: (k, 2) fixes, east and north.
        reckoned_m: (k, 2) dead-reckoned antenna, in a frame of its own.
        distance_m: (k,) distance driven.
    """

    time_s: Floats
    fixes_m: Floats
    reckoned_m: Floats
    distance_m: Floats


def matched(time_s: Floats, track: Floats, fixes: Floats) -> MatchedTrack:
    """Return the dead-reckoned track at the times of the fixes.

    Args:
        time_s: (n,) ticks.
        track: (n, 3) dead-reckoned east, north and distance [m].
        fixes: (k, 3) time [s], east, north [m].
    """
    inside = (fixes[:, 0] >= time_s[0]) & (fixes[:, 0] <= time_s[-1])
    at = fixes[inside, 0]
    east, north, distance = (np.interp(at, time_s, column) for column in track.T)
    return MatchedTrack(at, fixes[inside, 1:3], np.column_stack([east, north]), distance)


def successive(time_s: Floats) -> NDArray[np.bool_]:
    """Return (k − 1,) which of k fixes' steps have no gap in them, in which dead reckoning errs by more than a step."""
    step_s = np.diff(time_s)
    return np.asarray(step_s <= _GAP_STEPS * np.median(step_s))


def robust_sigma(values: Floats) -> float:
    """Return the robust standard deviation of values."""
    return _NORMAL * float(np.median(np.abs(values - np.median(values))))


def lateral_m(track: MatchedTrack, length_m: float) -> Floats:
    """Return distances of fixes from dead reckoning, to the left, a length after it was laid over a length of fixes.

    Laying is by offset and rotation, least squares (S. Umeyama, IEEE Trans. PAMI 13(4), 1991, without scale). On a
    straight line that is the distance from a line fitted over the length before.

    Args:
        track: Fixes and dead reckoning.
        length_m: The length.

    Returns:
        (w,) of windows that start a tenth of the length apart.
    """
    found = []
    ends = np.arange(track.distance_m[0] + length_m, track.distance_m[-1] - length_m, length_m / _STARTS)
    edges = np.searchsorted(track.distance_m, np.column_stack([ends - length_m, ends, ends + length_m]))
    for first, last, later in edges.tolist():
        if last - first < _LEAST_FIXES:
            continue
        turn, offset = _laid(track.reckoned_m[first : last + 1], track.fixes_m[first : last + 1])
        off = track.fixes_m[later] - (_turned(track.reckoned_m[later], turn) + offset)
        ahead = _turned(track.reckoned_m[later] - track.reckoned_m[max(later - 1, 0)], turn)
        size = np.hypot(*ahead)
        if size > 0.0:
            found.append((ahead[0] * off[1] - ahead[1] * off[0]) / size)
    return np.array(found)


def lateral_sigma_m(track: MatchedTrack, length_m: float) -> float | None:
    """Return the robust standard deviation of `lateral_m`; None of too short a drive."""
    if track.distance_m[-1] - track.distance_m[0] < (_LEAST_WINDOWS + 1) * length_m:
        return None
    found = lateral_m(track, length_m)
    return robust_sigma(found) if len(found) >= _LEAST_WINDOWS else None


def chord_ratios(track: MatchedTrack, length_m: float) -> Floats:
    """Return the distance between two fixes over that by dead reckoning, of straight stretches of a length.

    Args:
        track: Fixes and dead reckoning.
        length_m: Distance driven between both.

    Returns:
        (w,) of disjoint stretches.
    """
    starts = np.arange(track.distance_m[0], track.distance_m[-1] - length_m, length_m)
    first, last = (np.searchsorted(track.distance_m, starts + add) for add in (0.0, length_m))
    last = np.minimum(last, len(track.time_s) - 1)
    by_fixes = np.hypot(*(track.fixes_m[last] - track.fixes_m[first]).T)
    reckoned = np.hypot(*(track.reckoned_m[last] - track.reckoned_m[first]).T)
    driven = track.distance_m[last] - track.distance_m[first]
    straight = (reckoned > _STRAIGHT * driven) & (driven > 0.5 * length_m) & (driven < 2.0 * length_m)
    ratios: Floats = by_fixes[straight] / reckoned[straight]
    return ratios


class StepErrors(NamedTuple):
    """Differences of successive fixes less those of dead reckoning.

    Attributes:
        map_m: (k, 2) east and north.
        own_m: (k, 2) ahead and to the left.
    """

    map_m: Floats
    own_m: Floats


def step_errors(track: MatchedTrack, length_m: float = 5.0) -> StepErrors:
    """Return the errors of the steps from fix to fix.

    Args:
        track: Fixes and dead reckoning.
        length_m: Distance driven over which dead reckoning is laid over the fixes, about each step.
    """
    at, turns = [], []
    for middle in np.arange(track.distance_m[0], track.distance_m[-1], 0.2 * length_m).tolist():
        first, last = np.searchsorted(track.distance_m, (middle - 0.5 * length_m, middle + 0.5 * length_m)).tolist()
        if last - first >= _LEAST_FIXES:
            at.append(middle)
            turns.append(_laid(track.reckoned_m[first:last], track.fixes_m[first:last])[0])
    if not at:
        return StepErrors(np.zeros((0, 2)), np.zeros((0, 2)))
    turn = np.interp(track.distance_m[:-1], at, np.unwrap(turns))
    own = np.diff(track.reckoned_m, axis=0)
    off = np.diff(track.fixes_m, axis=0) - _each_turned(own, turn)
    ahead = np.where(np.hypot(*own.T) > 0.0, np.arctan2(own[:, 1], own[:, 0]), 0.0) + turn
    return StepErrors(off, _each_turned(off, -ahead))


def scatter_m(errors_m: Floats) -> float:
    """Return the white part of fixes an axis, by the second differences of step errors to the left.

    A third difference of white noise has 20 times its variance; of what changes slowly little is left.

    Args:
        errors_m: (k,) step errors to the left of successive fixes, or their part while the robot drives.
    """
    return robust_sigma(np.diff(errors_m, n=2)) / float(np.sqrt(20.0))


def lateral_weights(places_m: Floats, length_m: float) -> Floats:
    """Return weights of positions in a lateral distance: −1 times a line fitted over a length, and 1 a length later.

    Args:
        places_m: (p,) places in the fitted length, from −length to 0.
        length_m: The length.

    Returns:
        (p + 1,) weights, of the later position last.
    """
    middle = places_m.mean()
    off = places_m - middle
    line = 1.0 / len(places_m) + (length_m - middle) * off / (off**2).sum()
    return np.append(-line, 1.0)


def _laid(points: Floats, aims: Floats) -> tuple[float, Floats]:
    """Return the turn [rad] and then the offset (2,) that lay points over aims."""
    middle, aim = points.sum(axis=0) / len(points), aims.sum(axis=0) / len(aims)
    a, b = points - middle, aims - aim
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    return turn, aim - _turned(middle, turn)


def _turned(vector: Floats, turn: float) -> Floats:
    cos, sin = np.cos(turn), np.sin(turn)
    return np.array([cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]])


def _each_turned(vectors: Floats, turns: Floats) -> Floats:
    cos, sin = np.cos(turns), np.sin(turns)
    return np.column_stack([cos * vectors[:, 0] - sin * vectors[:, 1], sin * vectors[:, 0] + cos * vectors[:, 1]])
