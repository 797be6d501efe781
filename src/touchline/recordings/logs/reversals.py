"""Stretches in which a robot drives against the sign of its wheels: the course of the fixes is opposite to its heading.

A speed without a sign, as receivers and many hall sensors give it, is positive backwards, too. Where a robot reverses,
the course of its fixes turns by 180° while the gyro turns by nothing. The angle between course and turn is followed
modulo 180° from chord to chord of the track, so that neither the heading at the start nor a drift of the gyro counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Span = tuple[float, float]

_CHORD_M: Final = 0.3
_CHORD_SIGMAS: Final = 20.0
_FOLLOWED: Final = 0.3
"""Share of a chord's deviation by which the followed angle moves."""
_FITS_RAD: Final = 0.2
"""Median deviation up to which course and turn are of one robot."""
_FIRST_CHORDS: Final = 10
_LEAST_CHORDS: Final = 3
_DRIVEN_SHARE: Final = 0.5
_TOLD_SHARE: Final = 0.8
_REST_MPS: Final = 0.02
_REST_RADPS: Final = 0.05
_SMOOTH_S: Final = 0.1
_LIKE_SLOWEST_M: Final = 0.002
_NAMED: Final = 3

UNSIGNED: Final = 'say "unsigned": true of the mapping\'s wheels, and import the log anew'
"""Remedy for wheels without a sign."""


class _Chords(NamedTuple):
    """Chords of the track of the fixes, over which the wheels have driven.

    Attributes:
        begin_s: (n,) begins.
        end_s: (n,) ends.
        length_m: (n,) lengths.
        off_rad: (n,) course less turn, of the direction in which the wheels say that the robot drives.
    """

    begin_s: Floats
    end_s: Floats
    length_m: Floats
    off_rad: Floats


def reversals(time_s: Floats, distance_m: Floats, turn_radps: Floats, fixes: Floats) -> tuple[Span, ...]:
    """Return the stretches in which a robot drives against the sign of its wheels; none if course and turn do not fit.

    The shorter part of the drive is taken for them. The first may begin at −∞, the last end at ∞.

    Args:
        time_s: (n,) times.
        distance_m: (n,) distance by the wheels, total, less where they count backward.
        turn_radps: (n,) yaw rate; NaN where there is none. What it is at rest does not count.
        fixes: (k, 4) time [s], east, north, reported σ [m] of the RTK-fixed positions.
    """
    chords = _chords(time_s, distance_m, turn_radps, fixes)
    if len(chords.length_m) < _FIRST_CHORDS:
        return ()
    deviation, against = _followed(chords.off_rad)
    against = _without_blips(against)
    if np.median(np.abs(deviation)) > _FITS_RAD or not 0 < against.sum() < len(against):
        return ()
    if chords.length_m[against].sum() > chords.length_m[~against].sum():
        against = ~against
    changes = np.flatnonzero(np.diff(against)).tolist()
    edges = [_slowest_s(time_s, distance_m, chords.begin_s[each], chords.end_s[each + 1]) for each in changes]
    begins = [-math.inf] * bool(against[0]) + edges[int(against[0]) :: 2]
    ends = edges[1 - int(against[0]) :: 2] + [math.inf] * bool(against[-1])
    return tuple(zip(begins, ends, strict=True))


def within(time_s: Floats, spans: tuple[Span, ...]) -> NDArray[np.bool_]:
    """Return (n,) True for times inside of one of the spans."""
    inside = np.zeros(len(time_s), dtype=bool)
    for begin_s, end_s in spans:
        inside |= (time_s >= begin_s) & (time_s < end_s)
    return inside


def in_words(spans: Sequence[Span], duration_s: float) -> str:
    """Return the times of spans, of many the first ones.

    Args:
        spans: Begins and ends.
        duration_s: Length of the log, which ends what has no end.
    """
    named = [f"from {max(begin_s, 0.0):.1f} to {min(end_s, duration_s):.1f} s" for begin_s, end_s in spans[:_NAMED]]
    more = [f"in {len(spans) - _NAMED} more stretches"] if len(spans) > _NAMED else []
    return ", ".join(named + more)


def against_the_wheels(spans: Sequence[Span], duration_s: float) -> str:
    """Return what a session with spans has, in words.

    Args:
        spans: What `reversals` has found.
        duration_s: Length of the session.
    """
    return (
        f"has a speed without a sign: {in_words(spans, duration_s)} the course of the fixes is opposite to the "
        "heading, so the robot reverses, and the wheels count as before"
    )


def _chords(time_s: Floats, distance_m: Floats, turn_radps: Floats, fixes: Floats) -> _Chords:
    """Return the chords; none if wheels and gyro do not tell most of the track."""
    fixes = fixes[(fixes[:, 0] >= time_s[0]) & (fixes[:, 0] <= time_s[-1])]
    least_m = max(_CHORD_M, _CHORD_SIGMAS * float(np.median(fixes[:, 3]))) if len(fixes) else _CHORD_M
    ends = list[int]()
    for index, place in enumerate(fixes[:, 1:3]):
        if not ends or math.dist(place, fixes[ends[-1], 1:3]) >= least_m:
            ends.append(index)
    at_s, steps = fixes[ends, 0], np.diff(fixes[ends, 1:3], axis=0)
    length_m, course = np.hypot(*steps.T), np.arctan2(steps[:, 1], steps[:, 0])
    driven_m = np.diff(np.interp(at_s, time_s, distance_m))
    step_s = np.diff(time_s, prepend=time_s[0])
    rests = np.abs(np.diff(distance_m, prepend=distance_m[0])) < _REST_MPS * step_s
    rests &= np.abs(turn_radps) < _REST_RADPS
    missing = np.isnan(turn_radps)
    turn, gap_s = (
        np.interp(at_s, time_s, np.cumsum(rates * step_s))
        for rates in (np.where(rests | missing, 0.0, turn_radps), missing)
    )
    off_rad = course - 0.5 * (turn[1:] + turn[:-1]) + np.where(driven_m < 0.0, math.pi, 0.0)
    told = np.abs(driven_m) > _DRIVEN_SHARE * length_m  # else the antenna turns about the axle, or the receiver jumps
    told &= np.diff(gap_s) == 0.0
    if length_m[told].sum() < _TOLD_SHARE * length_m.sum():
        told[:] = False
    return _Chords(at_s[:-1][told], at_s[1:][told], length_m[told], off_rad[told])


def _followed(off_rad: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return deviations from an angle that is followed modulo π, and where the opposite of it is meant."""
    axis = 0.5 * float(np.angle(np.exp(2j * off_rad[:_FIRST_CHORDS]).sum()))
    deviation, against = np.zeros(len(off_rad)), np.zeros(len(off_rad), dtype=bool)
    for index, off in enumerate(off_rad.tolist()):
        deviation[index] = 0.5 * math.remainder(2.0 * (off - axis), 2.0 * math.pi)
        against[index] = math.cos(off - axis) < 0.0
        axis += _FOLLOWED * deviation[index]
    return deviation, against


def _without_blips(against: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the flags with runs of fewer than `_LEAST_CHORDS` as what is before them."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(against)) + 1, [len(against)]))
    kept = against.copy()
    for first, last in zip(edges[1:-1].tolist(), edges[2:].tolist(), strict=True):
        if last - first < _LEAST_CHORDS:
            kept[first:last] = kept[first - 1]
    return kept


def _slowest_s(time_s: Floats, distance_m: Floats, begin_s: float, end_s: float) -> float:
    """Return the middle of the time at which the wheels are slowest within a span."""
    inside = time_s[(time_s >= begin_s) & (time_s <= end_s)]
    ahead, behind = (np.interp(inside + add, time_s, distance_m) for add in (_SMOOTH_S, -_SMOOTH_S))
    moved = np.abs(ahead - behind)
    return float(np.median(inside[moved <= moved.min() + _LIKE_SLOWEST_M]))
