"""The noise figures of the filter, from the vehicle's and the sensors' data sheets."""

from __future__ import annotations

import math

from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.filter_model import FIX_DOF, POSE_DOF, FilterFigures
from touchline.onboard.interface import TICK_S
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import GNSS, ODOMETRY, OVERHEAD_CAMERA, Vehicle

_SPEED_NOISE_MPS = 0.0005  # per tick, from pitching and vibration, beyond the accelerometer's own noise
_YAW_NOISE_RADPS = 0.08  # per tick: 8 rad/s² is half of what the wheels can do
_GYRO_FLOOR_RADPS = 1e-4
_MAG_FLOOR_RAD = 0.005
_POSITION_FLOOR_M = 0.002
_POSE_HEADING_FLOOR_RAD = 0.002
_SLIP_FLOOR = 0.002
_RISE = 0.007  # 1 σ an axis: fields are drained by a fall of 0.5 to 2 %
_RISE_CHANGE_PM = 0.003**2 / 50.0  # per metre: the fall of a crowned field changes
_SIDE_FLOOR_MPS2 = 0.02
_MEAN_SLIP = 0.007  # 1 σ: rolling resistance takes half a per cent
_LEARNED_SLIP = 0.004  # 1 σ of what is left of it once it has been learned
_BRIDGED_S = 30.0  # an outage that the reported σ has to cover
_WARMING_S = 60.0  # over which a bias that drifts with the temperature counts as a random walk


def noise_figures(vehicle: Vehicle, config: OnboardConfig, drive_model: OnboardDrive) -> FilterFigures:
    """Constants of the filter, from the vehicle's and the sensors' data sheets."""
    imu, mag, drive = config.imu, config.magnetometer, config.drive
    rate_hz = config.camera.rate_hz if vehicle.positioning == OVERHEAD_CAMERA else config.gnss.rate_hz
    c = FilterFigures()
    _position_figures(c, vehicle, config)
    c.q_speed = imu.accel_density_mps2_rthz**2 * TICK_S + _SPEED_NOISE_MPS**2
    c.q_yaw_rate = _YAW_NOISE_RADPS**2
    warming_kps = imu.warming_k / imu.warming_tau_s
    gyro_drift, accel_drift = (
        per_k * warming_kps * math.sqrt(_WARMING_S)
        for per_k in (imu.gyro_temperature_radps_per_k, imu.accel_temperature_mps2_per_k)
    )
    c.q_gyro_bias = (max(imu.gyro_bias_walk_radps_rts, 1e-6) ** 2 + gyro_drift**2) * TICK_S
    c.q_accel_bias = (max(imu.accel_bias_walk_mps2_rts, 1e-4) ** 2 + accel_drift**2) * TICK_S
    fast = max(drive.slip_relative, _SLIP_FLOOR) ** 2
    for i, lasting in enumerate(drive_model.lasting_errors):
        if lasting is None:
            c.slip_var[i], tau = _bridging_term(fast, drive.slip_tau_s, _LEARNED_SLIP**2)
            c.mean_slip_var[i] = _MEAN_SLIP**2
            c.r_mean_slip[i] = fast * 2.0 * drive.slip_tau_s * rate_hz
        else:  # it stays where it is found, so there is no mean to be learned
            c.slip_var[i], tau = lasting.sigma**2, lasting.tau_s
            c.r_mean_slip[i] = math.inf
        c.slip_decay[i] = math.exp(-TICK_S / tau)
    c.rise_var = (_RISE * GRAVITY_MPS2) ** 2
    c.q_rise = _RISE_CHANGE_PM * GRAVITY_MPS2**2
    c.side_bias_var = imu.accel_turn_on_bias_mps2**2 + 1e-6
    c.q_side_bias = c.q_accel_bias
    c.r_side = imu.accel_density_mps2_rthz**2 / TICK_S + _SIDE_FLOOR_MPS2**2
    c.mag_var, tau = _one_term(
        ((max(mag.bias_rad, 0.01), 1e4), (max(mag.disturbance_rad, 0.01), mag.disturbance_tau_s))
    )
    c.mag_decay = math.exp(-TICK_S / tau)
    c.r_gyro = imu.gyro_density_radps_rthz**2 / TICK_S + _GYRO_FLOOR_RADPS**2
    c.r_mag = max(mag.white_rad, _MAG_FLOOR_RAD) ** 2
    c.q_side_m = drive.side_slip_m_rtm**2
    c.side_slip_rad_per_mps2 = drive_model.side_slip_rad_per_mps2
    return c


def _position_figures(c: FilterFigures, vehicle: Vehicle, config: OnboardConfig) -> None:
    """Fill in what depends on what positions the robot.

    A camera sees the body itself, without an arm, a mast and a slow error: those are zero, and its poses are fixes with
    a heading. With odometry alone there is nothing of them.
    """
    if vehicle.positioning == GNSS:
        gnss, body = config.gnss, vehicle.body
        c.antenna_x_m, c.antenna_y_m = body.gnss_antenna_x_m, body.gnss_antenna_y_m
        c.mast_s2 = body.gnss_antenna_z_m / GRAVITY_MPS2
        c.gnss_var, tau = _one_term(
            (
                (max(gnss.gauss_markov_1_m, 1e-4), gnss.gauss_markov_1_tau_s),
                (max(gnss.gauss_markov_2_m, 1e-4), gnss.gauss_markov_2_tau_s),
            )
        )
        c.gnss_decay = math.exp(-TICK_S / tau)
        c.r_gnss, c.fix_dof = max(gnss.white_m, _POSITION_FLOOR_M) ** 2, FIX_DOF
    elif vehicle.positioning == OVERHEAD_CAMERA:
        c.r_gnss, c.fix_dof = max(config.camera.white_m, _POSITION_FLOOR_M) ** 2, POSE_DOF
        c.r_heading = max(config.camera.white_rad, _POSE_HEADING_FLOOR_RAD) ** 2
    elif vehicle.positioning == ODOMETRY:
        c.scale_var = config.odometry.scale_relative**2


def _one_term(terms: tuple[tuple[float, float], ...]) -> tuple[float, float]:
    """Variance and time constant [s] of the one Gauss-Markov term nearest to the sum of several (σ, τ).

    Variance and the slope of the autocorrelation at lag 0 are those of the sum: exact over the seconds for which
    dead reckoning can tell the slow error from motion.
    """
    variance = sum(sigma**2 for sigma, _ in terms)
    return variance, variance / sum(sigma**2 / tau for sigma, tau in terms)


def _bridging_term(variance: float, tau_s: float, constant: float) -> tuple[float, float]:
    """Variance and time constant [s] of the Gauss-Markov term that stands for another one plus a constant error.

    The slope of its autocorrelation at lag 0 is that of the fast term, and its spectral density at frequency 0
    lets the distance travelled in an outage of `_BRIDGED_S` be as uncertain as both together make it.
    """
    slope, density = variance / tau_s, 2.0 * variance * tau_s + constant * _BRIDGED_S
    return math.sqrt(0.5 * density * slope), math.sqrt(0.5 * density / slope)
