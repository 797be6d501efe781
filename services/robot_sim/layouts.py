"""Byte layouts of frequent messages: one `FixedLayout` per message, made once."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from touchline.schemas import messages as m
from touchline.schemas.frames import BODY_FRAME, GNSS_FRAME, IMU_FRAME, MAP_FRAME
from touchline.schemas.layout import FixedLayout

CLOCK: Final = FixedLayout(m.Clock)
GNSS_FIX: Final = FixedLayout(m.NavSatFix, {"header.frame_id": GNSS_FRAME})
CAMERA_POSE: Final = FixedLayout(m.PoseWithCovarianceStamped, {"header.frame_id": MAP_FRAME})
GNSS_STATUS: Final = FixedLayout(m.GnssStatus, {"header.frame_id": GNSS_FRAME})
IMU: Final = FixedLayout(m.Imu, {"header.frame_id": IMU_FRAME})
MAGNETIC_FIELD: Final = FixedLayout(m.MagneticField, {"header.frame_id": IMU_FRAME})
ODOMETRY: Final = FixedLayout(m.Odometry, {"header.frame_id": MAP_FRAME, "child_frame_id": BODY_FRAME})
ESTIMATOR: Final = FixedLayout(m.EstimatorStatus, {"header.frame_id": MAP_FRAME})
SPRAYER: Final = FixedLayout(m.SprayerState, {"header.frame_id": BODY_FRAME})
WHEREABOUTS: Final = FixedLayout(m.Whereabouts, {"header.frame_id": MAP_FRAME})
PLAN_STATE: Final = FixedLayout(m.PlanState, {"header.frame_id": MAP_FRAME})
AREA: Final = FixedLayout(m.AreaProgress, {"header.frame_id": MAP_FRAME})
BATTERY: Final = FixedLayout(m.BatteryState, {"header.frame_id": BODY_FRAME, "location": "battery"})


@lru_cache(maxsize=16)
def scan(frame: str, beams: int) -> FixedLayout:
    """Return the layout of a lidar's scans."""
    return FixedLayout(m.LaserScan, {"header.frame_id": frame}, {"ranges": beams})


@lru_cache(maxsize=16)
def joint_states(joints: tuple[str, ...]) -> FixedLayout:
    """Return the layout of the states of these joints."""
    count = len(joints)
    return FixedLayout(
        m.JointState, {"header.frame_id": BODY_FRAME, "name": joints}, {"position": count, "velocity": count}
    )


@lru_cache(maxsize=16)
def actuator_command(names: tuple[str, ...]) -> FixedLayout:
    """Return the layout of a command to these actuators."""
    return FixedLayout(m.ActuatorCommand, {"header.frame_id": BODY_FRAME, "names": names}, {"values": len(names)})


@lru_cache(maxsize=256)
def paint_marks(segment_id: str, points: int) -> FixedLayout:
    """Return the layout of this many points of paint on a line."""
    return FixedLayout(
        m.PaintMarks, {"header.frame_id": MAP_FRAME, "segment_id": segment_id}, {"x_m": points, "y_m": points}
    )


# One at a time is in use, until the next line or reason. It names every line of the job: few are cached, as thousands
# take a gigabyte.
# take a gigabyte.
@lru_cache(maxsize=4)
def status(reason: str, segment_id: str, painted_ids: tuple[str, ...]) -> FixedLayout:
    """Return the layout of a status with these texts.

    Args:
        reason: Reason of the state.
        segment_id: Id of the segment under the robot.
        painted_ids: Ids of the lines to be painted.
    """
    return FixedLayout(
        m.TraversalStatus,
        {"header.frame_id": MAP_FRAME, "reason": reason, "segment_id": segment_id, "painted_ids": painted_ids},
        {"painted_fraction": len(painted_ids)},
    )


# It names every line, too; it changes with the next job only.
@lru_cache(maxsize=2)
def true_coverage(painted_ids: tuple[str, ...]) -> FixedLayout:
    """Return the layout of the true coverage of these lines."""
    return FixedLayout(
        m.TrueCoverage,
        {"header.frame_id": MAP_FRAME, "painted_ids": painted_ids},
        {"painted_fraction": len(painted_ids)},
    )
