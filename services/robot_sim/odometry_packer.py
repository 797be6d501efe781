"""Packing of estimates and true poses, of many ticks at once."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.layout import Payloads, Records
from touchline.services.robot_sim import layouts, tick_log
from touchline.services.robot_sim.tick_log import Rows

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

STAMP: Final = {"header.stamp.sec": 1, "header.stamp.nanosec": 1}
NO_STAMP: Final = (0, 0)
_NO_ODOMETRY: Final = (0.0,) * (7 + 36 + 6 + 36)
_C: Final = tick_log.COVARIANCE
_T: Final = tick_log.TWIST_COVARIANCE
_COVARIANCE: Final = {
    "pose.covariance[0]": slice(_C, _C + 2),
    "pose.covariance[5]": slice(_C + 2, _C + 3),
    "pose.covariance[6]": slice(_C + 1, _C + 5, 3),
    "pose.covariance[11]": slice(_C + 5, _C + 6),
    "pose.covariance[30]": slice(_C + 2, _C + 6, 3),
    "pose.covariance[35]": slice(_C + 8, _C + 9),
    "twist.covariance[0]": slice(_T, _T + 1),
    "twist.covariance[5]": slice(_T + 1, _T + 2),
    "twist.covariance[30]": slice(_T + 2, _T + 3),
    "twist.covariance[35]": slice(_T + 3, _T + 4),
}
"""Columns of `tick_log` for the covariances of (x, y, z, roll, pitch, yaw) and of their rates."""


class OdometryPacker:
    """Packer of odometry messages.

    Args:
        most: Largest number of ticks at once.
    """

    def __init__(self, most: int) -> None:
        """Prepare the records."""
        pose = {"pose.pose.position.x": 2, "pose.pose.orientation.z": 2}
        twist = {"twist.twist.linear.x": 1, "twist.twist.angular.z": 1}
        odometry = layouts.ODOMETRY.pack(*NO_STAMP, *_NO_ODOMETRY)
        covariance = {path: len(range(tick_log.TRUTH)[columns]) for path, columns in _COVARIANCE.items()}
        self._estimate = Records(layouts.ODOMETRY, odometry, STAMP | pose | twist | covariance, most)
        self._truth = Records(layouts.ODOMETRY, odometry, STAMP | pose | twist, most)

    def estimates(self, rows: Rows) -> Payloads:
        """Pack the estimates in rows (n, tick_log.columns)."""
        covariance = (rows[:, columns] for columns in _COVARIANCE.values())
        motion = _motion(rows[:, tick_log.ESTIMATE : tick_log.COVARIANCE])
        return self._estimate.pack(*stamps(rows, tick_log.TICK), *motion, *covariance)

    def truths(self, rows: Rows) -> Payloads:
        """Pack the true poses and speeds in rows (n, tick_log.columns)."""
        motion = _motion(rows[:, tick_log.TRUTH : tick_log.SPRAYER])
        return self._truth.pack(*stamps(rows, tick_log.TICK), *motion)


def stamps(rows: Rows, column: int) -> tuple[Integers, Integers]:
    """Return seconds and nanoseconds (n, 1) of sim time at the ends of ticks.

    Args:
        rows: (n, tick_log.columns).
        column: Column with the ticks.
    """
    whole = rows[:, column : column + 1].astype(np.int64)
    return whole // 100, whole % 100 * 10_000_000


def _motion(rows: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return position (n, 2), the quaternion's z and w (n, 2), speed and yaw rate (n, 1) of rows (n, 5)."""
    turned = [(math.sin(0.5 * heading), math.cos(0.5 * heading)) for heading in rows[:, 2].tolist()]
    return rows[:, :2], np.array(turned).reshape(-1, 2), rows[:, 3:4], rows[:, 4:5]
