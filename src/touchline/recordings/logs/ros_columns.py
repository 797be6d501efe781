"""Columns of numbers of ROS messages: every number by its path, and the quantities that our sensors need."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any, Final

import numpy as np

from touchline.recordings.decoding import Decode, decoder, full_name, layout
from touchline.recordings.logs.foreign_sensors import FIXED, FLOAT, NONE, SINGLE
from touchline.recordings.logs.log_table import Floats
from touchline.recordings.recorded import Damage, RecordingKind

RTK_SIGMA_M: Final = 0.05
"""A receiver that reports this or less has an RTK-fixed position, whatever its status is."""
FLOAT_SIGMA_M: Final = 1.0
_GBAS: Final = 2
_MOST_ELEMENTS = 36
_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_YAWS: Final = {
    "nav_msgs/msg/Odometry": "pose.pose.orientation",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose.orientation",
    "geometry_msgs/msg/PoseStamped": "pose.orientation",
}
_NO_TEXT: Final = ("string", "wstring")


class RosColumns:
    """Collector of the numbers in messages of one topic.

    Args:
        kind: Kind of the messages.

    Raises:
        Damage: They cannot be decoded.
    """

    def __init__(self, kind: RecordingKind) -> None:
        self.type = full_name(kind.type)
        read, fields = decoder(kind), layout(kind)
        if read is None or fields is None:
            problem = f"its type {kind.type or '(none)'} is not defined in the log, or is too large"
            raise Damage(f"{problem}, or its encoding is not known")
        self._read: Decode = read
        self._numbers = [path for path, form in fields.items() if "[" not in path and form not in _NO_TEXT]
        self._arrays = [
            path.partition("[")[0]
            for path, form in fields.items()
            if path.count("[") == 1 and path.endswith("]") and form not in _NO_TEXT
        ]
        self._get: Callable[[Any], Any] = attrgetter(*self._numbers, *self._arrays, "__class__", "__class__")
        self._named = self.type == "sensor_msgs/msg/JointState"
        self._values = array("d")
        self._extra: dict[str, tuple[array[int], array[float]]] = {}
        self._arrived = array("d")

    def take(self, payload: bytes, log_time_ns: int) -> None:
        """Take a message.

        Raises:
            Damage: It cannot be decoded.
        """
        message: Any = self._read(payload)
        *values, _, _ = self._get(message)  # at least two names, as for one alone it gives no tuple
        row = len(self._arrived)
        fields = tuple(map(float, values[: len(self._numbers)]))
        names: Sequence[str] = message.name if self._named else ()
        for path, elements in zip(self._arrays, values[len(self._numbers) :], strict=True):
            if len(elements) > _MOST_ELEMENTS:
                continue
            labels = names if len(names) == len(elements) and self._named else range(len(elements))
            for label, value in zip(labels, elements, strict=True):
                rows, numbers = self._extra.setdefault(f"{path}[{label}]", (array("q"), array("d")))
                rows.append(row)
                numbers.append(float(value))
        self._values.extend(fields)
        self._arrived.append(log_time_ns / 1e9)

    def columns(self) -> dict[str, Floats]:
        """Return columns, (n,) each: every number by its path, and the quantities of standard types."""
        n, table = len(self._arrived), self._table()
        found = {path: table[:, i] for i, path in enumerate(self._numbers)}
        for path, (rows, values) in self._extra.items():
            column = np.full(n, np.nan)
            column[np.array(rows)] = np.array(values)
            found[path] = column
        if self.type in _YAWS:
            found["heading_rad"] = _yaw(found, _YAWS[self.type])
        if {"latitude", "longitude", "status.status"} <= found.keys():
            found |= _fix(found)
        return found

    def times(self) -> Floats:
        """Return (n,) stamps [s]; the time of arrival where a message has none."""
        arrived = np.array(self._arrived)
        if not set(_STAMP) <= set(self._numbers):
            return arrived
        table = self._table()
        sec, nanosec = (table[:, self._numbers.index(path)] for path in _STAMP)
        return np.where(sec > 0, sec + nanosec / 1e9, arrived)

    def _table(self) -> Floats:
        """Return (n, k) the numbers that every message has."""
        return np.array(self._values).reshape(len(self._arrived), len(self._numbers))


def _yaw(found: dict[str, Floats], path: str) -> Floats:
    """Return the heading of a body with this quaternion; NaN where it is invalid."""
    x, y, z, w = (found[f"{path}.{axis}"] for axis in "xyzw")
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.where(np.abs(x * x + y * y + z * z + w * w - 1.0) < 0.1, yaw, np.nan)


def _fix(found: dict[str, Floats]) -> dict[str, Floats]:
    """Return kind and σ of the fixes of `NavSatFix` and `GPSFix`.

    A status of −1 is none. A reported σ of 5 cm or less is RTK-fixed; ground-based augmentation with up to a metre, or
    with no σ, is float; all else is single.
    """
    n = len(found["latitude"])
    nothing = np.full(n, np.nan)
    variances = [found.get(f"position_covariance[{i}]", nothing) for i in (0, 4)]
    known = found.get("position_covariance_type", nothing) != 0
    east, north = (np.sqrt(np.where(known & (v > 0), v, np.nan)) for v in variances)
    sigma, status = np.fmax(east, north), found["status.status"]
    augmented = (status == _GBAS) & ~(sigma > FLOAT_SIGMA_M)
    fix = np.where(status < 0, NONE, np.where(sigma <= RTK_SIGMA_M, FIXED, np.where(augmented, FLOAT, SINGLE)))
    return {"fix": fix.astype(np.float64), "sigma_east_m": east, "sigma_north_m": north}
