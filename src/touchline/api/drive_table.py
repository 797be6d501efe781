"""Table of a drive, tick by tick: truth, estimate, reference, sensors and commands against time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.api.path_samples import ARC, CURVATURE
from touchline.onboard.executive.traversal_states import NAMES
from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.trajectory.path import poses_along
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim import drive_log as log
from touchline.services.robot_sim.sensors import position_report

Floats = NDArray[np.float64]
POSE = ("x_m", "y_m", "heading_rad", "speed_mps", "yaw_rate_radps")
STATES = np.array(list(NAMES.values()))
REPORTED = {
    "latitude_deg": position_report.LATITUDE,
    "longitude_deg": position_report.LONGITUDE,
    "x_m": position_report.EAST,
    "y_m": position_report.NORTH,
    "variance_m2": position_report.VARIANCE,
    "fix": position_report.FIX,
    "satellites": position_report.SATELLITES,
    "correction_age_s": position_report.CORRECTION_AGE,
}
"""Columns of a position report, by name."""


def drive_table(rows: Floats, vehicle: Vehicle, course: LoadedTrajectory) -> NDArray[np.void]:
    """Convert the rows of a drive's log.

    Args:
        rows: (n, `drive_log.columns`) log, a row for each tick.
        vehicle: The robot.
        course: Trajectory that it drove.

    Returns:
        (n,) structured array, SI units, map frame, angles counter-clockwise: time_s, state, segment (index), station_m
        (arc length where the robot believes to be), truth_*, estimate_* and reference_* poses, sigma_* of the estimate,
        lateral_error_m (true distance of the tool's point to the left of its planned path), lateral_belief_m (the same
        as the robot believes) and heading_error_rad as it believes, valve and paint, tank and battery, imu_*, mag_*,
        encoder_*, gnss_* (NaN between position reports), and command_*.
    """
    reference = reference_poses(course, rows[:, log.STATION])
    columns: dict[str, NDArray[Any]] = {
        "time_s": rows[:, log.TICK] / TICKS_PER_S,
        "state": STATES[rows[:, log.STATE].astype(np.int64)],
        "segment": segment_at(course, rows[:, log.STATION]),
        "station_m": rows[:, log.STATION],
    }
    columns |= {f"truth_{name}": rows[:, log.TRUTH + i] for i, name in enumerate(POSE)}
    columns |= {f"estimate_{name}": rows[:, log.ESTIMATE + i] for i, name in enumerate(POSE)}
    columns |= {f"reference_{name}": reference[:, i] for i, name in enumerate(POSE[:3])}
    columns["reference_speed_mps"] = rows[:, log.REFERENCE_SPEED]
    variances = [rows[:, log.VARIANCES + i] for i in range(3)]
    for name, variance in zip(("sigma_x_m", "sigma_y_m", "sigma_heading_rad"), variances, strict=True):
        columns[name] = np.sqrt(np.maximum(variance, 0.0))
    truth = rows[:, log.TRUTH : log.TRUTH + 3]
    curvature = course.path[columns["segment"], CURVATURE]
    columns["lateral_error_m"] = lateral_error_m(truth, reference, curvature, vehicle.tool.point_m)
    columns["lateral_belief_m"] = rows[:, log.LATERAL]
    columns["heading_error_rad"] = rows[:, log.HEADING_ERROR]
    columns["valve"] = rows[:, log.SPRAYER] > 0.0
    columns["valve_open"] = rows[:, log.SPRAYER + 1] > 0.0
    for name, at in (("flow_lps", log.FLOW_LPS), ("tank_l", log.TANK_L), ("battery_wh", log.BATTERY_WH)):
        columns[name] = rows[:, at]
    columns["power_w"] = rows[:, log.POWER_W]
    names = [f"{sensor}_{axis}" for sensor in ("imu_rate", "imu_force", "mag") for axis in "xyz"]
    columns |= {name: rows[:, log.READINGS + i] for i, name in enumerate(names)}
    count = len(vehicle.drive.actuators)
    for i, actuator in enumerate(vehicle.drive.actuators):
        columns[f"encoder_{actuator.name}_rad"] = rows[:, log.READINGS + len(names) + i]
        columns[f"command_{actuator.name}"] = rows[:, log.READINGS + len(names) + count + i]
    arrived = rows[:, log.FIXES] > 0.0
    report = np.where(arrived[:, None], rows[:, log.REPORT : log.REPORT + position_report.COLUMNS], np.nan)
    columns["gnss_arrived"] = arrived
    columns |= {f"gnss_{name}": report[:, i] for name, i in REPORTED.items()}
    table = np.zeros(len(rows), [(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    return table


def segment_at(course: LoadedTrajectory, station_m: Floats) -> NDArray[np.int64]:
    """Indices (n,) of the segments at arc lengths (n,); turns on the spot have none."""
    found = np.searchsorted(course.path[:, ARC], station_m, side="right") - 1
    return np.asarray(np.clip(found, 0, len(course.path) - 1), np.int64)


def reference_poses(course: LoadedTrajectory, station_m: Floats) -> Floats:
    """Poses (n, 3) of the planned path at arc lengths (n,): x, y (m), heading (rad), map frame."""
    rows = course.path[segment_at(course, station_m)]
    poses = poses_along(rows, np.clip(station_m - rows[:, ARC], 0.0, None))
    poses[:, 2] = np.remainder(poses[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    return poses


def lateral_error_m(truth: Floats, reference: Floats, curvature: Floats, point_m: tuple[float, float]) -> Floats:
    """Distance of the tool's point to the left of its own planned path (m).

    Args:
        truth: (n, 3) true poses: x, y (m), heading (rad).
        reference: (n, 3) planned poses.
        curvature: (n,) curvature of the robot's planned path (1/m).
        point_m: Tool's point in the robot's frame.
    """
    x, y = point_m

    def points(poses: Floats) -> NDArray[np.complex128]:
        return np.asarray(poses[:, 0] + 1j * poses[:, 1] + complex(x, y) * np.exp(1j * poses[:, 2]))

    along = reference[:, 2] + np.arctan2(curvature * x, 1.0 - curvature * y)
    return np.asarray(((points(truth) - points(reference)) * np.exp(-1j * along)).imag)
