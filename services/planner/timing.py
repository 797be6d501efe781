"""How fast the robot drives along the path: the fastest profile under caps on speed and acceleration.

Between two entries the squared speed is linear in arc length (constant acceleration), so the profile is exact, starts
from standstill and ends in it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from schemas.errors import PlanningError
from services.planner.clothoid import Floats

SPEED_TOLERANCE_MPS = 1e-9
# Entries closer than this (m) say the same.
STATION_TOLERANCE_M = 1e-9


class Cap(NamedTuple):
    """Up to `end_m` of arc length, from where the last cap ended: at most this speed and acceleration, either way."""

    end_m: float
    speed_mps: float
    acceleration_mps2: float


class Steady(NamedTuple):
    """From `start_m` to `end_m` of arc length: one speed, at most `speed_mps`."""

    start_m: float
    end_m: float
    speed_mps: float


@dataclass(frozen=True)
class SpeedProfile:
    """Speeds (m/s) (n,) at arc lengths (m) (n,), with constant acceleration in between."""

    station_m: Floats
    speed_mps: Floats

    @cached_property
    def time_s(self) -> Floats:
        """Time (s) (n,) at each entry."""
        mean = 0.5 * (self.speed_mps[1:] + self.speed_mps[:-1])
        return np.concatenate(([0.0], np.cumsum(np.diff(self.station_m) / mean)))

    @property
    def total_time_s(self) -> float:
        """Time from start to standstill, seconds."""
        return float(self.time_s[-1])

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
        return float(self.time_s[i] + 2.0 * ahead / (self.speed_mps[i] + float(self.speed_at(s_m))))

    def station_at(self, time_s: float) -> float:
        """Arc length (m) reached at `time_s`; clamped to the path."""
        time_s = min(max(time_s, 0.0), self.total_time_s)
        i = min(max(int(np.searchsorted(self.time_s, time_s, side="right")) - 1, 0), len(self.time_s) - 2)
        acceleration = (self.speed_mps[i + 1] - self.speed_mps[i]) / (self.time_s[i + 1] - self.time_s[i])
        since = time_s - self.time_s[i]
        return float(self.station_m[i] + (self.speed_mps[i] + 0.5 * acceleration * since) * since)


def speed_profile(caps: Sequence[Cap], steady: Sequence[Steady]) -> SpeedProfile:
    """The fastest profile under `caps`, constant over every `steady` stretch.

    `caps` begin at arc length 0; `steady` stretches may overlap each other. A steady stretch that cannot hold its speed
    throughout is driven more slowly throughout.

    Raises:
        PlanningError: A steady stretch begins or ends at standstill.
    """
    steady = [*steady]
    border = np.unique([0.0, *(c.end_m for c in caps), *(s.start_m for s in steady), *(s.end_m for s in steady)])
    border = border[(border >= 0.0) & (border <= caps[-1].end_m)]
    border = border[np.concatenate(([True], np.diff(border) > STATION_TOLERANCE_M))]
    middle = 0.5 * (border[1:] + border[:-1])
    cap = np.array(caps)[np.minimum(np.searchsorted([c.end_m for c in caps], middle), len(caps) - 1)]
    speed, acceleration = cap[:, 1].copy(), cap[:, 2]
    while True:
        for stretch in steady:
            inside = slice(*np.searchsorted(middle, (stretch.start_m, stretch.end_m)))
            speed[inside] = np.minimum(speed[inside], stretch.speed_mps)
        new = np.concatenate(([True], (np.diff(speed) != 0.0) | (np.diff(acceleration) != 0.0)))
        profile = _fastest(np.append(border[:-1][new], border[-1]), np.square(speed[new]), acceleration[new])
        slower = [s._replace(speed_mps=_slowest(profile, s)) for s in steady]
        if all(new.speed_mps >= old.speed_mps - SPEED_TOLERANCE_MPS for new, old in zip(slower, steady, strict=True)):
            return profile
        if min(s.speed_mps for s in slower) < SPEED_TOLERANCE_MPS:
            raise PlanningError("", "has to paint from or to a standstill", "leave room before and after the line")
        steady = slower


def _slowest(profile: SpeedProfile, stretch: Steady) -> float:
    inside = (profile.station_m > stretch.start_m) & (profile.station_m < stretch.end_m)
    ends = profile.speed_at(np.array([stretch.start_m, stretch.end_m]))
    return float(min(stretch.speed_mps, ends.min(), profile.speed_mps[inside].min(initial=math.inf)))


def _fastest(border: Floats, cap: Floats, acceleration: Floats) -> SpeedProfile:
    """Forward and backward pass over squared speeds; `cap` and `acceleration` (n-1,) hold between the borders (n,)."""
    caps, gains = cap.tolist(), (2.0 * acceleration).tolist()
    length = np.diff(border).tolist()
    square = [0.0, *np.minimum(cap[1:], cap[:-1]).tolist(), 0.0]
    for i in range(len(length)):
        square[i + 1] = min(square[i + 1], square[i] + gains[i] * length[i])
    for i in reversed(range(len(length))):
        square[i] = min(square[i], square[i + 1] + gains[i] * length[i])
    entries = [(0.0, 0.0)]
    for i, (start, end) in enumerate(pairwise(border.tolist())):
        top = min(caps[i], 0.5 * (square[i] + square[i + 1] + gains[i] * length[i]))
        rise, fall = ((top - square[j]) / gains[i] for j in (i, i + 1))
        entries += [(start + rise, top), (end - fall, top), (end, square[i + 1])]
    return _profile(entries)


def _profile(entries: list[tuple[float, float]]) -> SpeedProfile:
    """The profile through (arc length, squared speed), without repeated entries and those amid a constant speed."""
    kept = entries[:1]
    for station, square in entries[1:-1]:
        if station - kept[-1][0] <= STATION_TOLERANCE_M:
            continue
        if len(kept) > 1 and kept[-2][1] == kept[-1][1] == square:
            kept.pop()
        kept.append((station, square))
    if entries[-1][0] - kept[-1][0] <= STATION_TOLERANCE_M:
        kept.pop()
    kept.append(entries[-1])
    table = np.array(kept)
    return SpeedProfile(table[:, 0], np.sqrt(np.maximum(table[:, 1], 0.0)))
