"""Transforms between the map, the robot's body and parts fixed to it (REP-103, REP-105)."""

from __future__ import annotations

import math
import struct
from functools import cache
from typing import Final

from touchline.schemas.cdr import decode, encode
from touchline.schemas.frames import BODY_FRAME, GNSS_FRAME, IMU_FRAME, MAP_FRAME, TOOL_FRAME
from touchline.schemas.layout import FixedLayout
from touchline.schemas.messages import (
    Header,
    Odometry,
    Quaternion,
    TFMessage,
    TransformMessage,
    TransformStamped,
    Vector3,
)
from touchline.schemas.sensor_names import LIDAR, RANGER
from touchline.schemas.vehicles import Vehicle

_ODOMETRY: Final = FixedLayout(Odometry, {"header.frame_id": MAP_FRAME, "child_frame_id": BODY_FRAME})
_POSE: Final = struct.Struct("<7d")
_STAMP: Final = struct.Struct("<iI")
#: Behind the CDR header; in a TFMessage the count of its transforms comes first.
_STAMP_AT: Final = 4
_TRANSFORM_STAMP_AT: Final = 8
#: A tenth of a second, less what stamps may be rounded by.
_PERIOD_S: Final = 0.0999

Stamp = tuple[int, int]
"""Seconds and nanoseconds."""
PoseNumbers = tuple[float, float, float, float, float, float, float]
"""Position (m) and orientation (quaternion x, y, z, w)."""


def stamp_of(payload: bytes) -> Stamp:
    """Return the stamp of a message that begins with a header."""
    seconds, nanoseconds = _STAMP.unpack_from(payload, _STAMP_AT)
    return seconds, nanoseconds


def seconds_between(since: Stamp, until: Stamp) -> float:
    """Return the time from one stamp to another; infinite if the clock has restarted."""
    passed_s = until[0] - since[0] + (until[1] - since[1]) / 1e9
    return passed_s if passed_s >= 0.0 else math.inf


@cache
def _pose_at() -> int:
    """Return where the pose begins in an odometry message as robots send it."""
    return _ODOMETRY.place("pose.pose.position.x", 7)[0]


def pose_of(odometry: bytes) -> PoseNumbers:
    """Return the pose in an odometry message.

    Raises:
        PayloadError: It cannot be decoded.
    """
    if len(odometry) == _ODOMETRY.size:  # as robots send it; decoding takes ten times as long
        found: PoseNumbers = _POSE.unpack_from(odometry, _pose_at())
        return found
    pose = decode(Odometry, odometry).pose.pose
    at, turn = pose.position, pose.orientation
    return at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w


class MovingFrame:
    """Transform of a moving frame, ten times per second: viewers interpolate, and recordings stay small."""

    def __init__(self, frame: str) -> None:
        stamped = TransformStamped(header=Header(frame_id=MAP_FRAME), child_frame_id=frame)
        self._sample = encode(TFMessage(transforms=(stamped,)))
        self._sent_at: Stamp | None = None

    def due(self, stamp: Stamp) -> bool:
        """Return whether a transform is due then; called once per pose."""
        if self._sent_at is not None and seconds_between(self._sent_at, stamp) < _PERIOD_S:
            return False
        self._sent_at = stamp
        return True

    def at(self, stamp: Stamp, pose: PoseNumbers) -> bytes:
        """Return a TFMessage, whose numbers are at its end."""
        payload = bytearray(self._sample)
        _STAMP.pack_into(payload, _TRANSFORM_STAMP_AT, *stamp)
        _POSE.pack_into(payload, len(payload) - _POSE.size, *pose)
        return bytes(payload)


def fixed_frames(vehicle: Vehicle, prefix: str) -> TFMessage:
    """Return the transforms of antenna, IMU, tool and auxiliary sensors to the body's frame.

    Args:
        vehicle: The robot.
        prefix: Prefix of its frames' names.
    """
    body, (tool_x, tool_y) = vehicle.body, vehicle.tool.point_m
    places = {
        GNSS_FRAME: (body.gnss_antenna_x_m, body.gnss_antenna_y_m, body.gnss_antenna_z_m),
        IMU_FRAME: (0.0, 0.0, 0.0),
        TOOL_FRAME: (tool_x, tool_y, 0.0),
    }
    for each in vehicle.sensors:
        places[each.name] = (each.x_m, each.y_m, each.height_m if each.kind in (LIDAR, RANGER) else 0.0)
    turned = {each.name: each.direction_rad for each in vehicle.sensors if each.kind == RANGER}
    header = Header(frame_id=prefix + BODY_FRAME)
    return TFMessage(
        transforms=tuple(
            TransformStamped(
                header=header,
                child_frame_id=prefix + name,
                transform=TransformMessage(
                    translation=Vector3(x=x, y=y, z=z), rotation=_about_z(turned.get(name, 0.0))
                ),
            )
            for name, (x, y, z) in places.items()
        )
    )


def _about_z(angle_rad: float) -> Quaternion:
    return Quaternion(z=math.sin(0.5 * angle_rad), w=math.cos(0.5 * angle_rad))
