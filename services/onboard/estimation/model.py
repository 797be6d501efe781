"""The filter's states, its noise figures and the layout of its working arrays.

States (index, unit; "tick" is the 10 ms period):

| state | unit | model | source of the noise figure |
| --- | --- | --- | --- |
| EAST, NORTH | m | integrates the tick's mean speed; small random walk for side slip | grass, by distance |
| HEADING | rad, unwrapped | integrates the tick's mean yaw rate | – |
| SPEED | m/s, mean of the last tick | driven by the accelerometer less its bias | accelerometer density, vibration |
| YAW_RATE | rad/s, mean of the last tick | random walk | largest yaw acceleration of the wheels |
| GYRO_BIAS | rad/s | random walk | data sheet: turn-on bias, bias walk |
| ACCEL_BIAS | m/s² | random walk; holds gravity's part too, and turns with it on a slope | data sheet |
| LEFT_SLIP, RIGHT_SLIP | – | Gauss-Markov about its mean: ground speed = wheel speed·r·(1 − slip) | grass |
| MAG_BIAS | rad | Gauss-Markov plus a walk with rotation (hard iron moves with heading) | data sheet |
| GNSS_EAST, GNSS_NORTH | m | Gauss-Markov: the slow part of the RTK error | quantiles of a moving receiver |

The slow GNSS error is what keeps the filter honest: averaging a hundred fixes does not make a centimetre into a
millimetre when their errors are the same error.

Beside the states five figures are learned that change too slowly to be states (`learning`): the slope of the ground
(two), the bias of the accelerometer's left axis, and the mean slip of each wheel, which holds its radius error.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.interface import TICK_S

EAST: Final = 0
NORTH: Final = 1
HEADING: Final = 2
SPEED: Final = 3
YAW_RATE: Final = 4
GYRO_BIAS: Final = 5
ACCEL_BIAS: Final = 6
LEFT_SLIP: Final = 7
RIGHT_SLIP: Final = 8
MAG_BIAS: Final = 9
GNSS_EAST: Final = 10
GNSS_NORTH: Final = 11
STATES: Final = 12

RING: Final = 64
"""Ticks of history kept for late fixes [0.64 s]."""

# One tick's measurements other than GNSS, kept in the ring for replay; nan where there is none.
IN_GYRO: Final = 0  # rad/s, mean of the tick
IN_ACCEL: Final = 1  # m/s², mean of this tick and the one before: what the mean speed changed by
IN_LEFT: Final = 2  # m/s, nominal rim speed, mean of the tick
IN_RIGHT: Final = 3
IN_STILL: Final = 4  # 1 while no wheel has turned for a while
IN_MAG: Final = 5  # rad, magnetic heading
IN_SPAN: Final = 6  # ticks over which IN_LEFT and IN_RIGHT are means
IN_SIDE: Final = 7  # m/s², of the accelerometer's left axis
# What the tick is run with of that which is learned beside the states; nan before the filter has started.
IN_RISE_EAST: Final = 8  # m/s²: gravity times the ground's rise over run
IN_RISE_NORTH: Final = 9
IN_RISE_VAR: Final = 10  # (m/s²)², of both axes together
IN_LEFT_MEAN: Final = 11  # slip
IN_RIGHT_MEAN: Final = 12
IN_LEFT_SMOOTH: Final = 13  # m/s, nominal rim speed that slip is a share of
IN_RIGHT_SMOOTH: Final = 14
IN_REFUSED: Final = 15  # ticks in a row, up to this one, in which the wheels' readings were rejected
IN_ROUGH: Final = 16  # (m/s²)², mean square step of IN_ACCEL over the last ticks
IN_DISPUTED: Final = 17  # ticks in a row, up to this one, in which the accelerometer contradicted wheels that stand
INPUTS: Final = 18

# What is learned beside the states.
SIDE_BIAS: Final = 0  # m/s²
RISE_EAST: Final = 1  # m/s²: gravity times the ground's rise over run
RISE_NORTH: Final = 2
P_BIAS: Final = 3  # covariance of these three
P_BIAS_EAST: Final = 4
P_BIAS_NORTH: Final = 5
P_EAST: Final = 6
P_EAST_NORTH: Final = 7
P_NORTH: Final = 8
LEFT_MEAN: Final = 9  # slip
RIGHT_MEAN: Final = 10
MEAN_VAR: Final = 11  # left, right
SLOW: Final = 13

# One fix in the ring.
FIX_USED: Final = 0
FIX_EAST: Final = 1
FIX_NORTH: Final = 2
FIX_VARIANCE: Final = 3  # m², of the white part, its tail included
FIX_AFTER: Final = 4  # s from the slot's tick to the stamp
FIXES: Final = 5

# Noise figures and constants, see `noise_figures`.
C_TRACK: Final = 0
C_ANTENNA_X: Final = 1
C_ANTENNA_Y: Final = 2
C_Q_SPEED: Final = 3  # variance added per tick
C_Q_YAW: Final = 4
C_Q_GYRO_BIAS: Final = 5
C_Q_ACCEL_BIAS: Final = 6
C_SLIP_DECAY: Final = 7
C_SLIP_VAR: Final = 8
C_MAG_DECAY: Final = 9
C_MAG_VAR: Final = 10
C_GM_DECAY: Final = 11
C_GM_VAR: Final = 12
C_R_GYRO: Final = 13
C_R_ENCODER: Final = 14
C_R_MAG: Final = 15
C_R_GNSS: Final = 16
C_Q_SIDE: Final = 17  # m² of side slip per metre travelled
C_R_ENCODER_TURN: Final = 18  # relative, of the wheel's share of the turn (track width error)
C_SIDE_SLIP: Final = 19  # rad of slip angle per m/s² of lateral acceleration
C_MAST: Final = 20  # s²: height of the antenna over gravity
C_RISE_VAR: Final = 21  # (m/s²)²: at the start
C_Q_RISE: Final = 22  # per metre
C_SIDE_BIAS_VAR: Final = 23
C_Q_SIDE_BIAS: Final = 24  # per tick
C_R_SIDE: Final = 25
C_MEAN_SLIP_VAR: Final = 26
C_R_MEAN_SLIP: Final = 27  # of one fix's slip as a sample of the mean
FIGURES: Final = 28

# Counters the kernel keeps.
N_FIXES: Final = 0
N_FIX_REJECTED: Final = 1
N_FIX_OUTLYING_RUN: Final = 2  # in a row, used or not
N_FIX_LATE: Final = 3
N_FIX_DUPLICATE: Final = 4
N_RECOVERIES: Final = 5
N_ENCODER: Final = 6
N_ENCODER_REJECTED: Final = 7
N_ENCODER_REJECTED_RUN: Final = 8
N_MAG: Final = 9
N_MAG_REJECTED: Final = 10
NIS_FIX_SUM: Final = 11  # of fixes as they are weighed, each at most FIX_DOF + 2
NIS_ENCODER_SUM: Final = 12
NIS_MAG_SUM: Final = 13
NIS_FIX_LAST: Final = 14
INNOVATION_EAST: Final = 15
INNOVATION_NORTH: Final = 16
NIS_FIX_RECENT: Final = 17  # exponential mean over about the last ten fixes that were used
N_FIX_OUT_OF_ORDER: Final = 18
ENCODER_REJECTED_RECENT: Final = 19  # share, exponential over about 0.3 s: the slip test
N_GYRO_REJECTED: Final = 20  # at standstill: it turns, the wheels do not
FIX_DOUBT: Final = 21  # −ln of how likely an honest receiver's fixes are as outlying as those of the present run
COUNTERS: Final = 22

GATE_1_DOF: Final = 15.14  # χ², 99.99 %
GATE_2_DOF: Final = 18.42
FIX_DOF: Final = 3.5
"""Degrees of freedom of the Student-t distribution that the receiver's white errors are taken to have: a bivariate t
with these that has 68 % of the horizontal errors within 7 mm has 95.45 % within 16.0 mm and 99.73 % within 38.7 mm. The
published field test of the receiver has 7/17/38 mm (docs/robot-sim.md)."""

_SPEED_NOISE_MPS = 0.0005  # per tick, from pitching and vibration, beyond the accelerometer's own noise
_YAW_NOISE_RADPS = 0.08  # per tick: 8 rad/s² is half of what the wheels can do
_SIDE_SLIP_M2PM = 1e-6
_ENCODER_FLOOR_MPS = 0.002
_GYRO_FLOOR_RADPS = 1e-4
_MAG_FLOOR_RAD = 0.005
_GNSS_FLOOR_M = 0.002
_SLIP_FLOOR = 0.002
_GRAVITY_MPS2 = 9.81
_RISE = 0.007  # 1 σ an axis: fields are drained by a fall of 0.5 to 2 %
_RISE_CHANGE_PM = 0.003**2 / 50.0  # per metre: the fall of a crowned field changes
_SIDE_FLOOR_MPS2 = 0.02
_MEAN_SLIP = 0.007  # 1 σ: rolling resistance takes half a per cent
_LEARNED_SLIP = 0.004  # 1 σ of what is left of it once it has been learned
_BRIDGED_S = 30.0  # an outage that the reported σ has to cover
_WARMING_S = 60.0  # over which a bias that drifts with the temperature counts as a random walk


def noise_figures(vehicle: Vehicle, config: OnboardConfig) -> NDArray[np.float64]:
    """(FIGURES,) constants of the filter, from the vehicle's and the sensors' data sheets."""
    gnss, imu, mag, drive = config.gnss, config.imu, config.magnetometer, config.drive
    c = np.zeros(FIGURES)
    c[C_TRACK] = vehicle.drive.track_width_m
    c[C_ANTENNA_X], c[C_ANTENNA_Y] = vehicle.body.gnss_antenna_x_m, vehicle.body.gnss_antenna_y_m
    c[C_Q_SPEED] = imu.accel_density_mps2_rthz**2 * TICK_S + _SPEED_NOISE_MPS**2
    c[C_Q_YAW] = _YAW_NOISE_RADPS**2
    warming_kps = imu.warming_k / imu.warming_tau_s
    gyro_drift, accel_drift = (
        per_k * warming_kps * math.sqrt(_WARMING_S)
        for per_k in (imu.gyro_temperature_radps_per_k, imu.accel_temperature_mps2_per_k)
    )
    c[C_Q_GYRO_BIAS] = (max(imu.gyro_bias_walk_radps_rts, 1e-6) ** 2 + gyro_drift**2) * TICK_S
    c[C_Q_ACCEL_BIAS] = (max(imu.accel_bias_walk_mps2_rts, 1e-4) ** 2 + accel_drift**2) * TICK_S
    fast = max(drive.slip_relative, _SLIP_FLOOR) ** 2
    c[C_SLIP_VAR], tau = _bridging_term(fast, drive.slip_tau_s, _LEARNED_SLIP**2)
    c[C_SLIP_DECAY] = math.exp(-TICK_S / tau)
    c[C_MEAN_SLIP_VAR] = _MEAN_SLIP**2
    c[C_R_MEAN_SLIP] = fast * 2.0 * drive.slip_tau_s * gnss.rate_hz
    c[C_MAST] = vehicle.body.gnss_antenna_z_m / _GRAVITY_MPS2
    c[C_RISE_VAR] = (_RISE * _GRAVITY_MPS2) ** 2
    c[C_Q_RISE] = _RISE_CHANGE_PM * _GRAVITY_MPS2**2
    c[C_SIDE_BIAS_VAR] = imu.accel_turn_on_bias_mps2**2 + 1e-6
    c[C_Q_SIDE_BIAS] = c[C_Q_ACCEL_BIAS]
    c[C_R_SIDE] = imu.accel_density_mps2_rthz**2 / TICK_S + _SIDE_FLOOR_MPS2**2
    c[C_MAG_VAR], tau = _one_term(
        ((max(mag.bias_rad, 0.01), 1e4), (max(mag.disturbance_rad, 0.01), mag.disturbance_tau_s))
    )
    c[C_MAG_DECAY] = math.exp(-TICK_S / tau)
    c[C_GM_VAR], tau = _one_term(
        (
            (max(gnss.gauss_markov_1_m, 1e-4), gnss.gauss_markov_1_tau_s),
            (max(gnss.gauss_markov_2_m, 1e-4), gnss.gauss_markov_2_tau_s),
        )
    )
    c[C_GM_DECAY] = math.exp(-TICK_S / tau)
    c[C_R_GYRO] = imu.gyro_density_radps_rthz**2 / TICK_S + _GYRO_FLOOR_RADPS**2
    tick_m = 2.0 * math.pi / vehicle.drive.encoder_ticks_per_revolution * vehicle.drive.wheel_radius_m
    c[C_R_ENCODER] = (tick_m / TICK_S) ** 2 / 6.0 + _ENCODER_FLOOR_MPS**2
    c[C_R_MAG] = max(mag.white_rad, _MAG_FLOOR_RAD) ** 2
    c[C_R_GNSS] = max(gnss.white_m, _GNSS_FLOOR_M) ** 2
    c[C_Q_SIDE] = _SIDE_SLIP_M2PM
    c[C_SIDE_SLIP] = vehicle.drive.side_slip_rad_per_mps2
    c[C_R_ENCODER_TURN] = max(drive.track_width_relative, 0.001)
    return c


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
