"""Noise figures of the filter: those of each sensor by its data sheet, and those of the ground and the drive."""

from __future__ import annotations

from typing import Final

from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.estimation.aiding.camera_aiding import camera_figures
from touchline.onboard.estimation.aiding.encoder_aiding import encoder_figures
from touchline.onboard.estimation.aiding.gnss_aiding import gnss_figures
from touchline.onboard.estimation.aiding.imu_aiding import imu_figures
from touchline.onboard.estimation.aiding.magnetometer_aiding import magnetometer_figures
from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.filter_model import FilterFigures
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import GNSS, ODOMETRY, OVERHEAD_CAMERA, Vehicle

_YAW_NOISE_RADPS: Final = 0.08  # per tick: 8 rad/s² is half of what the wheels can do
_RISE: Final = 0.02  # 1 σ an axis: sports fields are drained by a fall of 0.5 to 2 %, banks and parks fall by more
_RISE_INDOORS: Final = 0.007
_RISE_CHANGE_PM: Final = 0.003**2 / 50.0  # per metre: the fall of a crowned field changes


def noise_figures(vehicle: Vehicle, config: OnboardConfig, drive_model: OnboardDrive) -> FilterFigures:
    """Return the constants of the filter.

    Args:
        vehicle: Vehicle, with its kind of positioning.
        config: Configuration, which has the data sheets.
        drive_model: Drive of the vehicle.
    """
    rate_hz = config.camera.rate_hz if vehicle.positioning == OVERHEAD_CAMERA else config.gnss.rate_hz
    c = FilterFigures()
    if vehicle.positioning == GNSS:
        gnss_figures(c, vehicle, config)
        c.crab_var = config.drive.crab_rad**2
    elif vehicle.positioning == OVERHEAD_CAMERA:
        camera_figures(c, config)
    elif vehicle.positioning == ODOMETRY:
        c.scale_var = config.odometry.scale_relative**2
    imu_figures(c, config)
    encoder_figures(c, config, drive_model, rate_hz)
    magnetometer_figures(c, config)
    c.q_yaw_rate = _YAW_NOISE_RADPS**2
    c.fix_doubt_most = CONTRADICTED
    c.rise_var = ((_RISE if vehicle.positioning == GNSS else _RISE_INDOORS) * GRAVITY_MPS2) ** 2
    c.q_rise = _RISE_CHANGE_PM * GRAVITY_MPS2**2
    return c
