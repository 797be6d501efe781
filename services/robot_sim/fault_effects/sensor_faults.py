"""Faults of the IMU, of the magnetometer, of the overhead camera and of lidars."""

from __future__ import annotations

import math

from touchline.schemas import faults as f
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.world.effects import Effects


def camera_outage(_fault: f.CameraOutage, effects: Effects, _acting: Acting) -> None:
    """Withhold the camera's poses; see `ApplyFault`."""
    effects.camera_out = True


def camera_swapped(fault: f.CameraSwapped, effects: Effects, _acting: Acting) -> None:
    """Tell poses of another robot; see `ApplyFault`."""
    effects.camera_east_m += fault.east_m
    effects.camera_north_m += fault.north_m
    effects.camera_rad += fault.turn_rad


def lidar_blind(_fault: f.LidarBlind, effects: Effects, _acting: Acting) -> None:
    """Take all returns; see `ApplyFault`."""
    effects.lidar_blind = True


def lidar_false_returns(fault: f.LidarFalseReturns, effects: Effects, _acting: Acting) -> None:
    """Add false returns: the largest share counts; see `ApplyFault`."""
    effects.lidar_false_share = max(effects.lidar_false_share, fault.share)


def imu_bias(fault: f.ImuBias, effects: Effects, _acting: Acting) -> None:
    """Add biases; see `ApplyFault`."""
    effects.gyro_bias_radps += fault.gyro_radps
    effects.accel_bias_mps2 += fault.accel_mps2


def imu_noisy(fault: f.ImuNoisy, effects: Effects, _acting: Acting) -> None:
    """Add white noise: variances add up; see `ApplyFault`."""
    effects.gyro_white_radps = math.hypot(effects.gyro_white_radps, fault.gyro_radps)
    effects.accel_white_mps2 = math.hypot(effects.accel_white_mps2, fault.accel_mps2)


def imu_stuck(_fault: f.ImuStuck, effects: Effects, _acting: Acting) -> None:
    """Repeat the last reading; see `ApplyFault`."""
    effects.imu_stuck = True


def magnetic_disturbance(fault: f.MagneticDisturbance, effects: Effects, _acting: Acting) -> None:
    """Add a magnetic field; see `ApplyFault`."""
    effects.field_east_t += fault.east_t
    effects.field_north_t += fault.north_t
