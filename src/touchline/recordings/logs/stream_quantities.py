"""Quantities of a stream, taken from its columns by the mapping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from touchline.recordings.logs.fix_kinds import FIX_KIND
from touchline.recordings.logs.log_table import Floats, LogContent, LogTable
from touchline.schemas.errors import SpecError
from touchline.schemas.log_mapping import Column, ScaledColumn, StreamSource
from touchline.schemas.plain_text import plain

_ROS_IMU: Final = {
    f"{name}_{axis}_{unit}": f"{field}.{axis}"
    for name, unit, field in (("gyro", "radps", "angular_velocity"), ("accel", "mps2", "linear_acceleration"))
    for axis in "xyz"
}
STANDARD_COLUMNS: Final[Mapping[str, Mapping[str, str]]] = {
    "sensor_msgs/msg/Imu": _ROS_IMU,
    "nav_msgs/msg/Odometry": {
        "speed_mps": "twist.twist.linear.x",
        "yaw_rate_radps": "twist.twist.angular.z",
        "east_m": "pose.pose.position.x",
        "north_m": "pose.pose.position.y",
    },
    "geometry_msgs/msg/TwistStamped": {"speed_mps": "twist.linear.x", "yaw_rate_radps": "twist.angular.z"},
    "geometry_msgs/msg/TwistWithCovarianceStamped": {
        "speed_mps": "twist.twist.linear.x",
        "yaw_rate_radps": "twist.twist.angular.z",
    },
    "geometry_msgs/msg/PoseStamped": {"east_m": "pose.position.x", "north_m": "pose.position.y"},
    "geometry_msgs/msg/PoseWithCovarianceStamped": {
        "east_m": "pose.pose.position.x",
        "north_m": "pose.pose.position.y",
    },
    "sensor_msgs/msg/NavSatFix": {
        "latitude_deg": "latitude",
        "longitude_deg": "longitude",
        "altitude_m": "altitude",
    },
    "csv": {"fix": FIX_KIND},
}
"""Columns of quantities in standard messages; in any other stream they bear the quantity's name.

The numbers of a table's column `fix` may mean anything: 3 is a position in three dimensions to most programs."""


class Quantities:
    """Quantities of one stream.

    Args:
        part: Part of the mapping: ``fixes``, ``imu`` …
        source: That part.
        content: Contents of the log.

    Raises:
        SpecError: The log has no such stream, or lacks a named column.
    """

    def __init__(self, part: str, source: StreamSource, content: LogContent) -> None:
        self._part, self._named = part, source.columns
        table = content.tables.get(source.stream)
        if table is None:
            names = plain(", ".join(content.tables) or "none that can be read", 300)
            raise SpecError("mapping", f"{part}.stream", f"is {source.stream!r}", f"name a stream of the log: {names}")
        self.table: LogTable = table
        self.time_s: Floats = table.time_s + source.time_offset_s
        for quantity, column in source.columns.items():
            self._column(quantity, column)

    def known(self, *quantities: str) -> bool:
        """Return whether the stream has all of these."""
        return all(self._where(quantity) is not None for quantity in quantities)

    def get(self, quantity: str) -> Floats:
        """Return (n,) a quantity; all NaN if the stream does not have it."""
        column = self._where(quantity)
        return np.full(len(self.time_s), np.nan) if column is None else self._column(quantity, column)

    def require(self, *sets: Sequence[str]) -> Sequence[str]:
        """Return the first of several sets of quantities that the stream has all of, of which the mapping names one.

        If it names none of them, what the stream has by default counts.

        Raises:
            SpecError: It has none of them.
        """
        named = [quantities for quantities in sets if not self._named.keys().isdisjoint(quantities)]
        for quantities in (*named, *sets):
            if self.known(*quantities):
                return quantities
        wanted = " or ".join(" and ".join(quantities) for quantities in sets)
        columns = plain(", ".join(self.table.columns), 300)
        problem = f"do not name the column of {self.table.stream} for {wanted}"
        raise SpecError("mapping", f"{self._part}.columns", problem, f"name them; its columns are {columns}")

    def _where(self, quantity: str) -> Column | None:
        if quantity in self._named:
            return self._named[quantity]
        name = STANDARD_COLUMNS.get(self.table.kind, {}).get(quantity, quantity)
        return name if name in self.table.columns else None

    def _column(self, quantity: str, column: Column) -> Floats:
        scaled = column if isinstance(column, ScaledColumn) else ScaledColumn(column=column)
        values = self.table.columns.get(scaled.column)
        if values is None:
            names = plain(", ".join(self.table.columns), 300)
            field = f"{self._part}.columns.{quantity}"
            problem = f"is {scaled.column!r}, which {self.table.stream} does not have"
            raise SpecError("mapping", field, problem, f"its columns are {names}")
        return values * scaled.scale + scaled.offset
