"""Streams of logs, and a mapping proposed by their standard types."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

from touchline.checking.importing.limited_reader import read_limited
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream
from touchline.recordings.logs.stream_quantities import STANDARD_COLUMNS
from touchline.schemas.log_mapping import FixSource, ImuSource, LogMapping, TrackSource, WheelSource

_PREFERRED: Final = {
    "fixes": ("ubx/NAV-PVT", "nmea/GGA", "rtklib/pos", "ubx/NAV-HPPOSLLH", "sensor_msgs/msg/NavSatFix", "gpx", "csv"),
    "imu": ("sensor_msgs/msg/Imu", "csv"),
    "wheels": ("sensor_msgs/msg/JointState", "nav_msgs/msg/Odometry", "geometry_msgs/msg/TwistStamped", "csv"),
    "reference": ("csv",),
}
"""Kinds of streams, the best first; of a kind the stream with the most messages is taken."""
_NEEDED: Final = {
    "fixes": (("latitude_deg", "longitude_deg"),),
    "imu": (("gyro_x_radps", "gyro_y_radps", "gyro_z_radps"), ("turn_rad",), ("yaw_rate_radps",)),
    "wheels": (("left_rad", "right_rad"), ("distance_m", "turn_rad"), ("speed_mps", "yaw_rate_radps")),
    "reference": (("east_m", "north_m"),),
}


def log_list(paths: Sequence[Path]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return the streams of logs of one drive, and the proposed mapping, as JSON.

    Raises:
        LogError: They cannot be read.
    """
    listed, content = read_limited(paths)
    streams = [
        {
            "stream": stream.name,
            "type": stream.kind,
            "messages": stream.messages,
            "rate_hz": _finite(stream.rate_hz),
            "from_s": _finite(stream.first_s),
            "to_s": _finite(stream.last_s),
            "note": stream.note,
        }
        for stream in listed
    ]
    return streams, _proposed(listed, content).model_dump(exclude_defaults=True, exclude_none=True)


def proposal(paths: Sequence[Path]) -> LogMapping:
    """Return the mapping for logs of standard types.

    Raises:
        LogError: They cannot be read, or hold no known sensor.
    """
    listed, content = read_limited(paths)
    proposed = _proposed(listed, content)
    if proposed.fixes is None and proposed.wheels is None and proposed.imu is None:
        problems = f" ({'; '.join(content.problems[:3])})" if content.problems else ""
        raise LogError(
            f"{', '.join(str(path) for path in paths)}: nothing in it is known as fixes, IMU or wheels{problems}; "
            "see what there is with --list, and write a mapping"
        )
    return proposed


def _proposed(listed: Sequence[LogStream], content: LogContent) -> LogMapping:
    def best(part: str) -> str | None:
        found: list[tuple[int, int, str]] = []
        for stream in listed:
            table = content.tables.get(stream.name)
            if table is None or stream.kind not in _PREFERRED[part] or not len(table.time_s):
                continue
            standard = STANDARD_COLUMNS.get(stream.kind, {})
            names = table.columns.keys() | {name for name, column in standard.items() if column in table.columns}
            if any(names.issuperset(quantities) for quantities in _NEEDED[part]):
                found.append((_PREFERRED[part].index(stream.kind), -stream.messages, stream.name))
        return min(found)[2] if found else None

    def source(part: str, kind: Callable[..., Any]) -> Any:
        name = best(part)
        return None if name is None else kind(stream=name)

    return LogMapping(
        fixes=source("fixes", FixSource),
        imu=source("imu", ImuSource),
        wheels=source("wheels", WheelSource),
        reference=source("reference", TrackSource),
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
