"""Prediction step of the filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.estimation.bursts import correlated_error
from touchline.onboard.filter_model import (
    ACCEL_BIAS,
    EAST,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS,
    GYRO_SCALE,
    HEADING,
    MAG_BIAS,
    NORTH,
    ODOMETRY_ERROR,
    SPEED,
    STATES,
    YAW_RATE,
    FilterFigures,
    LearnedFigures,
    TickInputs,
)
from touchline.onboard.interface import TICK_S

Floats = NDArray[np.float64]

_TURNS_FOR_S = 1.0
_SLIP_ANGLE_SHARE = 0.3  # how far the slip angle may be from the assumed one, over a metre


@kernel
def predict(x: Floats, P: Floats, accel: float, z: TickInputs, c: FilterFigures) -> None:
    """Predict one tick ahead: x ← f(x, u), P ← F P Fᵀ + Q, with F the Jacobian of f.

    Mean speed and yaw rate step first, then the pose integrates them. On a slope gravity pulls across, too: it adds to
    the drift of the robot, and as the robot turns it comes into the forward accelerometer's bias.

    Args:
        x: (STATES,) state, updated; states, units and noise are those of `filter_model`.
        P: (STATES, STATES) its covariance, updated.
        accel: Forward acceleration that the accelerometer reads [m/s²].
        z: Inputs of the tick.
        c: Figures of the filter.
    """
    x[SPEED] += (accel - x[ACCEL_BIAS]) * TICK_S
    turn = x[YAW_RATE] * TICK_S
    ahead = x[HEADING] + 0.5 * turn
    cos, sin = math.cos(ahead), math.sin(ahead)
    pull = cos * z.rise_north_mps2 - sin * z.rise_east_mps2
    # In a curve the robot drifts outward, on a slope downward: by an angle so small that its series will do.
    slip_angle = c.side_slip_rad_per_mps2 * (x[SPEED] * x[YAW_RATE] + math.copysign(1.0, x[SPEED]) * pull)
    # Seen from above, the way is shorter uphill and downhill, and its direction nearer to the contour.
    climb = cos * z.rise_east_mps2 + sin * z.rise_north_mps2
    aside = slip_angle + 0.5 * climb * pull / GRAVITY_MPS2**2
    straight = 1.0 - 0.5 * aside * aside
    cos, sin = straight * cos + aside * sin, straight * sin - aside * cos
    step = x[SPEED] * TICK_S * (1.0 - 0.5 * (climb / GRAVITY_MPS2) ** 2)
    x[EAST] += step * cos
    x[NORTH] += step * sin
    x[HEADING] += turn
    x[ACCEL_BIAS] += pull * turn
    for i in range(2):
        mean = z.error_mean[i]
        x[ODOMETRY_ERROR + i] = mean + c.slip_decay[i] * (x[ODOMETRY_ERROR + i] - mean)
    x[MAG_BIAS] *= c.mag_decay
    gnss_decay, gnss_var = correlated_error(z, c)
    x[GNSS_EAST] *= gnss_decay
    x[GNSS_NORTH] *= gnss_decay

    # F P Fᵀ for the sparse F, first rows then columns: speed, yaw rate and biases before the pose that uses them.
    for k in range(STATES):
        P[SPEED, k] -= TICK_S * P[ACCEL_BIAS, k]
    for k in range(STATES):
        P[k, SPEED] -= TICK_S * P[k, ACCEL_BIAS]
    P[SPEED, SPEED] += c.q_speed
    P[YAW_RATE, YAW_RATE] += c.q_yaw_rate
    de_dv, dn_dv = TICK_S * cos, TICK_S * sin
    de_dh, dn_dh = -step * sin, step * cos
    de_dw, dn_dw = 0.5 * TICK_S * de_dh, 0.5 * TICK_S * dn_dh
    for k in range(STATES):
        P[EAST, k] += de_dv * P[SPEED, k] + de_dh * P[HEADING, k] + de_dw * P[YAW_RATE, k]
        P[NORTH, k] += dn_dv * P[SPEED, k] + dn_dh * P[HEADING, k] + dn_dw * P[YAW_RATE, k]
        P[HEADING, k] += TICK_S * P[YAW_RATE, k]
    for k in range(STATES):
        P[k, EAST] += de_dv * P[k, SPEED] + de_dh * P[k, HEADING] + de_dw * P[k, YAW_RATE]
        P[k, NORTH] += dn_dv * P[k, SPEED] + dn_dh * P[k, HEADING] + dn_dw * P[k, YAW_RATE]
        P[k, HEADING] += TICK_S * P[k, YAW_RATE]
    for i in range(2):
        _decay(P, ODOMETRY_ERROR + i, c.slip_decay[i], c.slip_var[i])
    _decay(P, MAG_BIAS, c.mag_decay, c.mag_var)
    _decay(P, GNSS_EAST, gnss_decay, gnss_var)
    _decay(P, GNSS_NORTH, gnss_decay, gnss_var)
    # A hard-iron error is a vector fixed in the body: seen as heading it changes as fast as the robot turns.
    P[MAG_BIAS, MAG_BIAS] += c.mag_var * min(abs(turn), 1.0)
    P[GYRO_BIAS, GYRO_BIAS] += c.q_gyro_bias
    for i in range(len(c.q_constant)):
        P[GYRO_SCALE + i, GYRO_SCALE + i] += c.q_constant[i]
    # What is not known of the slope acts alike for as long as the robot turns on, and not at all when it only wavers.
    P[ACCEL_BIAS, ACCEL_BIAS] += c.q_accel_bias + z.rise_var * abs(turn) * min(abs(x[YAW_RATE]) * _TURNS_FOR_S, 1.0)
    unsure = _SLIP_ANGLE_SHARE * slip_angle
    side = (c.q_side_m + unsure * unsure) * abs(step)
    P[EAST, EAST] += side * sin * sin + c.q_slow
    P[NORTH, NORTH] += side * cos * cos + c.q_slow
    P[EAST, NORTH] -= side * sin * cos
    P[NORTH, EAST] -= side * sin * cos


@kernel
def add_scale_error(before: Floats, x: Floats, P: Floats, scale_var: float, learned: LearnedFigures) -> None:
    """Add to P the scale error of odometry alone: one share ε that no sensor measures.

    A constant that cannot be observed is no state, but is considered (S. F. Schmidt, "Application of State-Space
    Methods to Navigation Problems", Advances in Control Systems 3, 1966): a share ε moves the position by ε·d, with d
    the straight line from the start, since it stretches the path about its start. So P contains ε²·d·dᵀ.

    Args:
        before: (STATES,) state of the tick before.
        x: (STATES,) predicted state.
        P: (STATES, STATES) its covariance, updated.
        scale_var: Variance of ε.
        learned: Learned figures, which have the start.
    """
    e0, n0 = before[EAST] - learned.start_east_m, before[NORTH] - learned.start_north_m
    e1, n1 = x[EAST] - learned.start_east_m, x[NORTH] - learned.start_north_m
    P[EAST, EAST] += scale_var * (e1 * e1 - e0 * e0)
    P[NORTH, NORTH] += scale_var * (n1 * n1 - n0 * n0)
    P[EAST, NORTH] += scale_var * (e1 * n1 - e0 * n0)
    P[NORTH, EAST] = P[EAST, NORTH]


@kernel
def _decay(P: Floats, i: int, decay: float, variance: float) -> None:
    for k in range(STATES):
        P[i, k] *= decay
    for k in range(STATES):
        P[k, i] *= decay
    P[i, i] += variance * (1.0 - decay * decay)
