"""Agreement of the sensors of a log: the factors by which wheels, gyro, fixes and accelerometer differ."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.foreign_sensors import FixSeries, TrackSeries
from touchline.recordings.logs.log_table import Floats
from touchline.recordings.logs.tick_sensors import TICKS_PER_S, TickSensors
from touchline.schemas.vehicles.differential_drive import DifferentialDrive

_CHORD_M: Final = (0.3, 20.0)
_CHORD_SCATTERS: Final = 20.0
_LEAST: Final = 10
"""Number of comparisons from which they tell something."""
_MOST_AGREE: Final = 0.6
_AGREE_RATIO: Final = 0.3
_TURNS_SHARE: Final = 0.2
"""Share of the largest turn within a window that counts as one."""
_LEAST_TURN_RAD: Final = 0.003
_WINDOW_CHORDS: Final = 16
_LEAST_BENDS: Final = 6
_MOST_BENDS: Final = 300
_BENDS: Final = 0.85
"""Concentration of the courses of a window's chords below which it is a bend."""
_FITS: Final = 0.75
"""Mean concentration of course less turn over bends from which the turn is that of the course; 0.4 is chance."""
_BETTER: Final = 0.1
_SCALES: Final = np.concatenate([sign * np.geomspace(1 / 2000, 2000, 305) for sign in (1.0, -1.0)])
_AS_IS: Final = 152
_MOVES_SHARE: Final = 0.1
_STANDS_SHARE: Final = 3e-4
_BIN_TICKS: Final = TICKS_PER_S // 2
_WINDOW_TICKS: Final = TICKS_PER_S
_PUSHED_MPS2: Final = 0.15
_SAME_RAD: Final = 1e-3
_FOLLOWS: Final = 0.8
_EXPLAINED: Final = 0.3
"""Share of the horizontal force that the changes of the wheels' motion explain from which its direction is told."""


class Agreement(NamedTuple):
    """Ratios of what sensors tell of one motion; NaN where too little is told, or they do not go together.

    Attributes:
        driven: Distance by the wheels over that by the fixes.
        gyro: Turn by the gyro over that of the fixes' course; `gyro_axes` by each of its axes, forward, left, up.
        wheels: Turn by the wheels over that of the course; NaN if they have the gyro's.
        wheels_by_gyro: Turn by the wheels over that by the gyro, for which no fixes are needed.
        one_source: Whether wheels and gyro turn alike throughout, so that one of them may be made of the other.
        fixes_m: Way of the fixes, from chord to chord.
        force_mps2: (3,) mean specific force: forward, left, up.
        pushed: As `pushed_rad` has it.
        start_rad: Heading at the begin, by the first courses less the turns of the gyro.
    """

    driven: float
    gyro: float
    gyro_axes: tuple[float, float, float]
    wheels: float
    wheels_by_gyro: float
    one_source: bool
    fixes_m: float
    force_mps2: Floats
    pushed: float
    start_rad: float


def agreement(fixes: FixSeries | None, at_ticks: TickSensors, drive: DifferentialDrive) -> Agreement:
    """Compare the sensors of a log.

    Args:
        fixes: Fixes of the log.
        at_ticks: Its other sensors.
        drive: Drive whose wheels they have become.
    """
    steps = np.diff(at_ticks.angles_rad, axis=0, prepend=at_ticks.angles_rad[:1]) * drive.wheel_radius_m
    steps[~at_ticks.wheels_there] = np.nan
    step_m, wheels_rad = steps.mean(axis=1), np.diff(steps)[:, 0] / drive.track_width_m
    rates_rad = np.where(at_ticks.imu_there[:, None], at_ticks.imu[:, :3], np.nan) / TICKS_PER_S
    apart = _in_windows(np.column_stack([wheels_rad, rates_rad[:, 2]]))
    most = np.abs(apart).max(axis=0, initial=0.0)
    told = (np.abs(apart) > _TURNS_SHARE * most).all(axis=1) & bool((most > _LEAST_TURN_RAD).all())
    alike = np.abs(apart[told, 0] - apart[told, 1]) < 0.02 * np.abs(apart[told]).max(axis=1) + _SAME_RAD
    one_source = bool(len(alike) and alike.mean() > _FOLLOWS)
    ends_s = at_ticks.begin_s + np.arange(1, at_ticks.ticks + 1) / TICKS_PER_S
    course = _Course(fixes, ends_s, step_m)
    gyro_axes = tuple(course.turned(rates) for rates in rates_rad.T)
    return Agreement(
        driven=course.driven,
        gyro=gyro_axes[2],
        gyro_axes=(gyro_axes[0], gyro_axes[1], gyro_axes[2]),
        wheels=math.nan if one_source else course.turned(wheels_rad),
        wheels_by_gyro=_ratio(apart[told, 0], apart[told, 1]),
        one_source=one_source,
        fixes_m=course.length_m,
        force_mps2=_mean(at_ticks.imu[at_ticks.imu_there, 3:]),
        pushed=pushed_rad(at_ticks, drive, np.eye(3)),
        start_rad=course.start_rad(rates_rad[:, 2]),
    )


def pushed_rad(at_ticks: TickSensors, drive: DifferentialDrive, turned: Floats) -> float:
    """Return the angle from the horizontal force that wheels and gyro tell to the one that is measured.

    NaN if too little of it is explained, or told.

    Args:
        at_ticks: The sensors.
        drive: Drive whose wheels they have become.
        turned: (3, 3) rotation from the axes of the IMU at ticks to those that it is tried with.
    """
    whole = at_ticks.ticks // _BIN_TICKS * _BIN_TICKS
    speed_mps = np.diff(at_ticks.angles_rad.mean(axis=1), prepend=at_ticks.angles_rad[0].mean()) * drive.wheel_radius_m
    columns = [at_ticks.imu[:, 3:] @ turned.T, speed_mps * TICKS_PER_S, at_ticks.imu[:, :3] @ turned[2]]
    forward, left, _, speed, turn = np.column_stack(columns)[:whole].reshape(-1, _BIN_TICKS, 5).mean(axis=1).T
    if len(speed) < _LEAST:
        return math.nan
    told, felt = np.gradient(speed) * TICKS_PER_S / _BIN_TICKS + 1j * speed * turn, forward + 1j * left
    used = np.isfinite(told) & np.isfinite(felt) & (np.abs(told) > _PUSHED_MPS2)
    if used.sum() < _LEAST:
        return math.nan
    told, felt = told[used], felt[used] - np.nanmean(felt)
    product, felt_power = np.vdot(told, felt), np.vdot(felt, felt).real
    explained = abs(product) ** 2 > _EXPLAINED * np.vdot(told, told).real * felt_power
    return float(np.angle(product)) if explained else math.nan


def scatter_m(fixes: FixSeries) -> float:
    """Return the 1 σ an axis of fixes from one to the next, by their third differences; NaN of a few.

    The smallest fifth of the differences tells it, since others may have the robot's own motion in them.
    """
    place = fixes.place_m[fixes.fix > 0, :2]
    if len(place) < 3 * _LEAST:
        return math.nan
    return float(np.percentile(np.abs(np.diff(place, n=3, axis=0)), 20.0)) / 0.2533 / math.sqrt(20.0)


class HeadingFit(NamedTuple):
    """Heading of a track against its course.

    Attributes:
        scale: Factor that its values need, 1 if they are in rad, counter-clockwise; 0 if none makes them follow.
        offset_rad: What is left to add, within ±π/2, since a robot may reverse.
    """

    scale: float
    offset_rad: float


def heading_fit(track: TrackSeries) -> HeadingFit | None:
    """Return how the headings of a track fit its course; None if it has too few of them, or hardly turns."""
    chords = _chords(track.time_s, track.place_m[:, :2], _CHORD_M[0])
    if len(chords) <= _LEAST:
        return None
    steps = np.diff(track.place_m[chords, :2], axis=0)
    course = np.arctan2(steps[:, 1], steps[:, 0])
    middle_s = 0.5 * (track.time_s[chords][1:] + track.time_s[chords][:-1])
    heading = np.interp(middle_s, track.time_s, track.heading_rad)
    told = np.isfinite(heading)
    if told.sum() < _LEAST or abs(np.exp(2j * course[told]).mean()) > _FOLLOWS:
        return None
    off = {
        scale: complex(np.exp(2j * (course[told] - scale * heading[told])).mean())
        for scale in (1.0, -1.0, math.pi / 180.0, -math.pi / 180.0)
    }
    best = max(off, key=lambda scale: abs(off[scale]))
    return HeadingFit(best, 0.5 * float(np.angle(off[best]))) if abs(off[best]) > _FOLLOWS else HeadingFit(0.0, 0.0)


class _Course:
    """Chords of the track of the fixes, and what the wheels have driven over each."""

    def __init__(self, fixes: FixSeries | None, ends_s: Floats, step_m: Floats) -> None:
        self._ends_s, self.driven, self.length_m = ends_s, math.nan, 0.0
        self._middle_s = self._course = np.zeros(0)
        self._bends = np.zeros(0, dtype=np.int64)
        if fixes is None:
            return
        there = (fixes.fix > 0) & (fixes.time_s >= ends_s[0]) & (fixes.time_s <= ends_s[-1])
        scatter = scatter_m(fixes)
        if there.sum() <= _LEAST or not math.isfinite(scatter):
            return
        time_s, place_m = fixes.time_s[there], fixes.place_m[there, :2]
        extent_m = float(np.hypot(*np.ptp(place_m, axis=0)))
        least_m = min(float(np.clip(_CHORD_SCATTERS * scatter, *_CHORD_M)), max(extent_m / 20.0, 5.0 * scatter))
        chords = _chords(time_s, place_m, least_m)
        self._compare(time_s[chords], np.diff(place_m[chords], axis=0), step_m)

    def _compare(self, at_s: Floats, steps: Floats, step_m: Floats) -> None:
        length_m, course = np.hypot(*steps.T), np.arctan2(steps[:, 1], steps[:, 0])
        driven_m = _between(self._ends_s, step_m, at_s)
        told = np.isfinite(driven_m)
        if told.sum() < _LEAST:
            return
        self.length_m = float(length_m[told].sum())
        moving = told & (np.abs(driven_m) > _MOVES_SHARE * np.median(np.abs(driven_m[told])))
        self.driven = _ratio(np.abs(driven_m[moving]), length_m[moving])
        if np.abs(driven_m[told]).sum() < _STANDS_SHARE * self.length_m:
            self.driven = 0.0
        course = np.where(driven_m < 0.0, course + math.pi, course)
        self._middle_s, self._course = (0.5 * (at_s[1:] + at_s[:-1]))[moving], course[moving]
        bends = np.flatnonzero(np.abs(np.exp(1j * _windows(self._course)).mean(axis=1)) < _BENDS)
        self._bends = bends[:: 1 + len(bends) // _MOST_BENDS]

    def turned(self, step_rad: Floats) -> float:
        """Return by which factor the steps of a turn exceed the turns of the course; 1 if by about nothing."""
        if len(self._bends) < _LEAST_BENDS:
            return math.nan
        between = _between(self._ends_s, step_rad, self._middle_s)
        turns = _windows(np.concatenate(([0.0], np.cumsum(np.nan_to_num(between)))))[self._bends]
        missing = _windows(np.concatenate(([0.0], np.cumsum(np.isnan(between)))))[self._bends]
        told = missing[:, -1] == missing[:, 0]
        if told.sum() < _LEAST_BENDS:
            return math.nan
        course, turns = _windows(self._course)[self._bends][told], turns[told]
        fits = np.array([np.abs(np.exp(1j * (course - scale * turns)).mean(axis=1)).mean() for scale in _SCALES])
        best, as_is = int(fits.argmax()), float(fits[_AS_IS])
        if fits[best] < _FITS:
            return math.nan
        return 1.0 if fits[best] - as_is < _BETTER else 1.0 / float(_SCALES[best])

    def start_rad(self, step_rad: Floats) -> float:
        """Return the heading at the begin, by the first courses less the steps of a turn; NaN if they differ."""
        first = slice(0, _WINDOW_CHORDS)
        if len(self._course) < _WINDOW_CHORDS:
            return math.nan
        turned = np.interp(self._middle_s[first], self._ends_s, np.cumsum(np.nan_to_num(step_rad)))
        mean = np.exp(1j * (self._course[first] - turned)).mean()
        return float(np.angle(mean)) if abs(mean) > _FOLLOWS else math.nan


def _windows(values: Floats) -> Floats:
    """Return (m, `_WINDOW_CHORDS`) values of windows that overlap by three quarters."""
    if len(values) < _WINDOW_CHORDS:
        return np.zeros((0, _WINDOW_CHORDS))
    return np.lib.stride_tricks.sliding_window_view(values, _WINDOW_CHORDS)[:: _WINDOW_CHORDS // 4]


def _chords(time_s: Floats, place_m: Floats, least_m: float) -> NDArray[np.int64]:
    """Return the indices of points that are this far from each other."""
    found = [0] if len(time_s) else []
    for index, place in enumerate(place_m):
        if math.dist(place, place_m[found[-1]]) >= least_m:
            found.append(index)
    return np.array(found, dtype=np.int64)


def _between(ends_s: Floats, steps: Floats, at_s: Floats) -> Floats:
    """Return the sums (n - 1,) of ticks' steps between n times; NaN where one is missing."""
    missing = np.isnan(steps)
    total, gaps = (np.interp(at_s, ends_s, np.cumsum(each)) for each in (np.where(missing, 0.0, steps), missing))
    return np.where(np.diff(gaps) > 0.0, np.nan, np.diff(total))


def _in_windows(steps: Floats) -> Floats:
    """Return the sums (m, k) of steps over windows, those without missing ones."""
    whole = len(steps) // _WINDOW_TICKS * _WINDOW_TICKS
    sums = steps[:whole].reshape(-1, _WINDOW_TICKS, steps.shape[1]).sum(axis=1)
    return np.asarray(sums[np.isfinite(sums).all(axis=1)])


def _ratio(found: Floats, expected: Floats) -> float:
    """Return the median of the ratios of what was found and expected; NaN if they are few, or differ."""
    told = np.isfinite(found)
    if told.sum() < _LEAST:
        return math.nan
    ratios = found[told] / expected[told]
    middle = float(np.median(ratios))
    agree = np.abs(ratios - middle) < _AGREE_RATIO * abs(middle)
    return middle if agree.mean() > _MOST_AGREE else math.nan


def _mean(values: Floats) -> Floats:
    there = values[np.isfinite(values).all(axis=1)]
    return there.mean(axis=0) if len(there) else np.full(3, np.nan)
