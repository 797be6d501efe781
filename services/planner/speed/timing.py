"""Speed profile: the fastest one along the path that the drive can follow.

Between two entries the squared speed is linear in arc length (constant acceleration), so the profile is exact. It is
at rest at both ends and at every cusp and turn on the spot.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.limits import Limits
from touchline.services.planner.speed.path_grid import PathGrid

SPEED_TOLERANCE_MPS = 1e-9
ENTRY_TOLERANCE_MPS = 1e-4
# Robots ignore slower turns on the spot; turns of a fraction of a degree do not get that fast.
LEAST_SPIN_RADPS = 0.1
# An entry is redundant if it is closer than this (m) to another, or off the line between its neighbours by less
# (m²/s²).
STATION_TOLERANCE_M = 1e-9
SQUARE_TOLERANCE = 1e-12


class Steady(NamedTuple):
    """A stretch of arc length with a constant speed of at most `speed_mps`."""

    start_m: float
    end_m: float
    speed_mps: float


class Spin(NamedTuple):
    """A turn on the spot at `station_m` by `angle_rad`, at up to `rate_radps` (signed), that takes `seconds`."""

    station_m: float
    angle_rad: float
    rate_radps: float
    seconds: float


@dataclass(frozen=True)
class SpeedProfile:
    """Speeds (m/s) (n,) at arc lengths (m) (n,), with constant acceleration in between, and the turns on the spot."""

    station_m: Floats
    speed_mps: Floats
    spins: tuple[Spin, ...] = ()

    @cached_property
    def dwell_s(self) -> Floats:
        """Duration (s) (n,) of turning on the spot at each entry."""
        dwell = np.zeros(len(self.station_m))
        for spin in self.spins:
            dwell[np.argmin(np.abs(self.station_m - spin.station_m))] += spin.seconds
        return dwell

    @cached_property
    def time_s(self) -> Floats:
        """Time (s) (n,) of arrival at each entry."""
        mean = 0.5 * (self.speed_mps[1:] + self.speed_mps[:-1])
        return np.concatenate(([0.0], np.cumsum(np.diff(self.station_m) / mean + self.dwell_s[:-1])))

    @property
    def total_time_s(self) -> float:
        """Time from start to standstill (s)."""
        return float(self.time_s[-1] + self.dwell_s[-1])

    def speed_at(self, s_m: Floats | float) -> Floats:
        """Speed (m/s) at arc length `s_m` (any shape)."""
        squares = np.interp(s_m, self.station_m, np.square(self.speed_mps))
        return np.asarray(np.sqrt(squares))

    def time_at(self, s_m: float) -> float:
        """Time (s) at which arc length `s_m` is reached."""
        i = min(max(int(np.searchsorted(self.station_m, s_m, side="right")) - 1, 0), len(self.station_m) - 2)
        ahead = s_m - float(self.station_m[i])
        if ahead <= 0.0:
            return float(self.time_s[i])
        left = self.time_s[i] + self.dwell_s[i]
        return float(left + 2.0 * ahead / (self.speed_mps[i] + float(self.speed_at(s_m))))

    def station_at(self, time_s: float) -> float:
        """Arc length (m) reached at `time_s`; clamped to the path."""
        left = self.time_s + self.dwell_s
        i = min(max(int(np.searchsorted(left, time_s, side="right")) - 1, 0), len(left) - 2)
        driving = float(self.time_s[i + 1] - left[i])
        since = min(max(time_s - float(left[i]), 0.0), driving)
        acceleration = (self.speed_mps[i + 1] - self.speed_mps[i]) / driving
        return float(self.station_m[i] + (self.speed_mps[i] + 0.5 * acceleration * since) * since)


def keeps_entry(profile: SpeedProfile, entry_mps: float) -> bool:
    """True if a profile begins at the robot's current speed (m/s), so that the path can be entered at it."""
    return float(profile.speed_mps[0]) >= entry_mps - ENTRY_TOLERANCE_MPS


def speed_profile(course: PathGrid, steady: Sequence[Steady], limits: Limits, entry_mps: float = 0.0) -> SpeedProfile:
    """Compute the fastest profile along `course`, constant over every `steady` stretch.

    It begins at `entry_mps` at most (m/s): more slowly where the path cannot be entered as fast; see `keeps_entry`.

    The borders of `steady` stretches are borders of the course; they may overlap each other. A steady stretch that
    cannot hold its speed throughout is driven more slowly throughout.

    Args:
        course: Cells of the path.
        steady: Stretches of constant speed.
        limits: Limits of the plan.
        entry_mps: Speed at which the robot enters the path (m/s).

    Raises:
        PlanningError: A steady stretch begins or ends at standstill.
    """
    from touchline.services.planner.speed.topp import entries, sweep

    knots = course.station_m
    spans = [_knots_within(knots, stretch) for stretch in steady]
    speeds = [stretch.speed_mps for stretch in steady]
    cap = course.square_cap.copy()
    columns = (course.length_m, course.curvature_1pm, course.sharpness_1pm2, cap, limits.caps)
    while True:
        for (first, last), speed in zip(spans, speeds, strict=True):
            cap[first:last] = np.minimum(cap[first:last], speed * speed)
        square = np.full(len(knots), np.inf)
        square[[-1, *course.stops]] = 0.0
        square[0] = entry_mps**2
        sweep(*columns, square)
        slowest = [math.sqrt(square[first : last + 1].min()) for first, last in spans]
        if min(slowest, default=1.0) < SPEED_TOLERANCE_MPS:
            raise PlanningError("", "has to paint from or to a standstill", "leave room before and after the line")
        if all(new >= old - SPEED_TOLERANCE_MPS for new, old in zip(slowest, speeds, strict=True)):
            break
        speeds = slowest
    ideal, squared = entries(*columns, square)
    station = np.interp(ideal, np.concatenate(([0.0], np.cumsum(course.length_m))), knots)
    station, squared = _without_repeats(station, squared, knots[-1])
    return SpeedProfile(station, np.sqrt(squared), spins_of(course, limits))


def spins_of(course: PathGrid, limits: Limits) -> tuple[Spin, ...]:
    """Turns on the spot along a course, each as quick as the limits allow."""
    return tuple(_spin(course.station_m[at], angle, limits) for at, angle in course.spins)


def _spin(station_m: float, angle_rad: float, limits: Limits) -> Spin:
    from touchline.services.planner.drives.caps import spin_time

    lever = limits.caps.drive.spin_lever_m()
    rate_gain = limits.acceleration_mps2 / lever
    reached = max(math.sqrt(rate_gain * abs(angle_rad)), LEAST_SPIN_RADPS)
    rate = min(limits.transit_speed_mps / lever, reached)
    seconds = float(spin_time(abs(angle_rad), limits.caps))
    return Spin(float(station_m), angle_rad, math.copysign(rate, angle_rad), seconds)


def _knots_within(knots: Floats, stretch: Steady) -> tuple[int, int]:
    first, last = np.searchsorted(knots, (stretch.start_m - STATION_TOLERANCE_M, stretch.end_m - STATION_TOLERANCE_M))
    return int(first), max(int(last), int(first) + 1)


def _without_repeats(station: Floats, square: Floats, end_m: float) -> tuple[Floats, Floats]:
    """Drop redundant entries: repeated stations, and those on the line between their neighbours."""
    kept = [(0.0, float(square[0]))]
    for here, value in zip(station[1:].tolist(), square[1:].tolist(), strict=True):
        if here - kept[-1][0] <= STATION_TOLERANCE_M:
            continue
        if len(kept) > 1 and _on_straight(kept[-2], kept[-1], (here, value)):
            kept.pop()
        kept.append((here, value))
    kept[-1] = (float(end_m), float(square[-1]))
    table = np.array(kept)
    return table[:, 0], np.maximum(table[:, 1], 0.0)


def _on_straight(first: tuple[float, float], middle: tuple[float, float], last: tuple[float, float]) -> bool:
    if first[1] == middle[1] == last[1]:
        return True
    share = (middle[0] - first[0]) / (last[0] - first[0])
    return abs(first[1] + share * (last[1] - first[1]) - middle[1]) <= SQUARE_TOLERANCE
