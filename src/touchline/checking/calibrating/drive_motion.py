"""Facts about a drive that decide which constants it can tell."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_run import EstimatorRun
from touchline.onboard.estimation.consistency_monitor import MOVING_MPS
from touchline.onboard.interface import TICKS_PER_S

_MOVING_MPS: Final = 0.1
_EVERY_TICKS: Final = 10
_SPREAD_MPS: Final = 0.3
_HALF_TURN_RAD: Final = math.pi
_ABOUT_RAD: Final = math.pi / 2


class DriveMotion(NamedTuple):
    """DriveMotion of a robot in a recording, as far as constants depend on it.

    Attributes:
        left_rad: Sum of the turns to the left.
        right_rad: Sum of the turns to the right.
        headings_rad: Largest angle between two headings in which it drove, at most π.
        speeds_mps: Range of its speeds, backwards negative.
    """

    left_rad: float
    right_rad: float
    headings_rad: float
    speeds_mps: tuple[float, float]

    @property
    def turns_both_ways(self) -> str:
        """Return what is missing to tell a gyro's scale from its bias; empty if nothing is."""
        enough = min(self.left_rad, self.right_rad) >= _HALF_TURN_RAD
        return "" if enough else "turn by at least 180° to each side"

    @property
    def turns_about(self) -> str:
        """Return what is missing to tell an arm in the body from a shift of the map; empty if nothing is."""
        return "" if self.headings_rad >= _ABOUT_RAD else "drive in opposite directions"

    @property
    def changes_speed(self) -> str:
        """Return what is missing to tell a delay from an arm; empty if nothing is."""
        slow, fast = self.speeds_mps
        return "" if fast - slow >= _SPREAD_MPS else "change the speed by 0.3 m/s or more, best drive backwards"


def moving_ticks(run: EstimatorRun) -> NDArray[np.bool_]:
    """Return (ticks + 1,) whether the robot of a run moved, by what it had driven over the last tenth of a second.

    Fixes of standing receivers wander, and scatter less than their data sheets say.
    """
    moved_m = np.full(len(run.poses), np.nan)
    moved_m[_EVERY_TICKS:] = np.hypot(*(run.poses[_EVERY_TICKS:, :2] - run.poses[:-_EVERY_TICKS, :2]).T)
    return np.asarray(moved_m > MOVING_MPS * _EVERY_TICKS / TICKS_PER_S)


def motion_of(run: EstimatorRun) -> DriveMotion:
    """Return what the robot of a finished run did."""
    poses = run.poses[np.isfinite(run.poses).all(axis=1)]
    if len(poses) < 2:
        return DriveMotion(0.0, 0.0, 0.0, (0.0, 0.0))
    east_m, north_m, heading_rad = poses[::_EVERY_TICKS].T
    span_s = _EVERY_TICKS / TICKS_PER_S
    ahead_rad = heading_rad[:-1]
    speed_mps = (np.diff(east_m) * np.cos(ahead_rad) + np.diff(north_m) * np.sin(ahead_rad)) / span_s
    turns_rad = np.diff(heading_rad)
    moving = np.abs(speed_mps) > _MOVING_MPS
    driven = np.sort(np.mod(ahead_rad[moving], 2.0 * math.pi))
    gaps = np.diff(driven, append=driven[:1] + 2.0 * math.pi) if len(driven) else np.array([2.0 * math.pi])
    return DriveMotion(
        float(turns_rad[turns_rad > 0.0].sum()),
        float(-turns_rad[turns_rad < 0.0].sum()),
        min(2.0 * math.pi - float(gaps.max()), math.pi),
        (float(np.percentile(speed_mps, 2)), float(np.percentile(speed_mps, 98))),
    )
