"""Calibration: figures that change too slowly to be states of the filter and are learned beside it.

**Slope.** Less the acceleration in the curve, the accelerometer's left axis reads its own bias and the component of
gravity across: a_y − v·ω = b + g·(rise_n·cos θ − rise_e·sin θ). As the robot turns, the two can be told apart. A small
Kalman filter of three states, (b, g·rise_e, g·rise_n), does that; it needs neither speed nor position to be precise.
On waves of the ground the reading varies by far more than the sensor's noise, and in step with the heading, which they
sway: with the sensor's noise alone, that teaches a slope of 30 %. What innovations vary by about their mean beyond
their variance is therefore added to it (covariance matching: R. K. Mehra, "Approaches to adaptive filtering", IEEE
Trans. Automatic Control 17(5), 1972); the mast sways by as much, so that it counts for fixes, too.

**Mean slip.** The filter's slips vary about a mean that comes from rolling resistance and the tyres' radii. Each fix
is a sample of that mean.

Both learn from the oldest tick of the ring, in which nothing will change any more, so that late and reordered messages
lead to the same figures.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.estimation.standing import contradicts
from touchline.onboard.filter_model import (
    HEADING,
    ODOMETRY_ERROR,
    SPEED,
    YAW_RATE,
    FilterFigures,
    FixInTick,
    LearnedFigures,
    TickInputs,
)
from touchline.onboard.interface import TICK_S

Floats = NDArray[np.float64]

LEARN_TICKS: Final = 8
"""Ticks between two samples of the slope; a divisor of the ring's length. Nearer ones say nothing new."""
_CURVE_SHARE = 0.05  # of the curve's acceleration that may be wrong: slip, and the tyres' settling
_CLIP = 3.0  # σ: a bump or a skid may not teach more than that
_WAVES_SHARE = 0.03  # weight of the newest sample: about 3 s are averaged
_MEAN_SHARE = 0.1  # weight of the newest sample in the mean, which is over 0.8 s
_WAVES_MOST = 1.0  # (m/s²)² a sample counts: one skid is no wave
WAVE_SAMPLES: Final = 4.0
"""Number of samples, of the slope or of fixes, in which the ground leans the robot alike."""
_MOVING_MPS = 0.2
_MEAN_SLIP_WALK = 4e-9  # per fix: about a minute is remembered


def start_learning(c: FilterFigures, learned: LearnedFigures) -> None:
    """Reset the learned figures to level ground and no slip, with their uncertainty at the start.

    Args:
        c: Figures of the filter.
        learned: Learned figures, updated.
    """
    learned.reset(
        bias_var=c.side_bias_var,
        east_var=c.rise_var,
        north_var=c.rise_var,
        mean_var=c.mean_slip_var,
        constant_var=c.constant_var,
    )


@kernel
def store_learned(learned: LearnedFigures, z: TickInputs) -> None:
    """Store in a tick's inputs the learned figures that the tick is run with.

    Args:
        learned: Learned figures.
        z: Inputs of the tick, updated.
    """
    z.rise_east_mps2, z.rise_north_mps2 = learned.rise_east_mps2, learned.rise_north_mps2
    z.rise_var = learned.east_var + learned.north_var
    z.waves_var = max(learned.waves_var, 0.0)
    z.error_mean[0], z.error_mean[1] = learned.error_mean[0], learned.error_mean[1]


@kernel
def learn(slot: int, x: Floats, z: TickInputs, fix: FixInTick, c: FilterFigures, learned: LearnedFigures) -> None:
    """Learn from the oldest tick of the ring, which no late message changes any more.

    Args:
        slot: Place of the tick in the ring.
        x: (STATES,) posterior state of the tick.
        z: Inputs of the tick; their rise is not a number if the filter was not yet running.
        fix: Fix that is valid in the tick, if any.
        c: Figures of the filter.
        learned: Learned figures, updated.
    """
    if math.isnan(z.rise_east_mps2):
        return
    if slot % LEARN_TICKS == 0 and not math.isnan(z.side_mps2):
        _learn_slope(x, z, c, learned)
    if fix.used and abs(x[SPEED]) > _MOVING_MPS:
        for i in range(2):
            learned.mean_var[i] += _MEAN_SLIP_WALK
            gain = learned.mean_var[i] / (learned.mean_var[i] + c.r_mean_slip[i])
            most = _CLIP * math.sqrt(c.r_mean_slip[i])
            learned.error_mean[i] += gain * min(max(x[ODOMETRY_ERROR + i] - learned.error_mean[i], -most), most)
            learned.mean_var[i] *= 1.0 - gain


@kernel
def _learn_slope(x: Floats, z: TickInputs, c: FilterFigures, learned: LearnedFigures) -> None:
    """Update (bias, rise east, rise north) with the reading of the left axis beyond the curve (Kalman filter)."""
    learned.bias_var += c.q_side_bias * LEARN_TICKS
    grown = c.q_rise * abs(x[SPEED]) * TICK_S * LEARN_TICKS
    learned.east_var += grown
    learned.north_var += grown
    curve = x[SPEED] * x[YAW_RATE]
    east, north = -math.sin(x[HEADING]), math.cos(x[HEADING])  # of the row; that of the bias is 1
    g0 = learned.bias_var + east * learned.bias_east + north * learned.bias_north
    g1 = learned.bias_east + east * learned.east_var + north * learned.east_north
    g2 = learned.bias_north + east * learned.east_north + north * learned.north_var
    s = g0 + east * g1 + north * g2 + c.r_side + (_CURVE_SHARE * curve) ** 2
    innovation = (
        z.side_mps2 - curve - learned.side_bias_mps2 - east * learned.rise_east_mps2 - north * learned.rise_north_mps2
    )
    if z.still and contradicts(innovation, s):
        return
    if not z.still:
        learned.side_mean_mps2 += _MEAN_SHARE * (innovation - learned.side_mean_mps2)
        wave = min((innovation - learned.side_mean_mps2) ** 2, _WAVES_MOST)
        learned.waves_var += _WAVES_SHARE * (wave - s - learned.waves_var)
    s += WAVE_SAMPLES * max(learned.waves_var, 0.0)
    most = _CLIP * math.sqrt(s)
    innovation = min(max(innovation, -most), most)
    learned.side_bias_mps2 += g0 * innovation / s
    learned.rise_east_mps2 += g1 * innovation / s
    learned.rise_north_mps2 += g2 * innovation / s
    learned.bias_var -= g0 * g0 / s
    learned.bias_east -= g0 * g1 / s
    learned.bias_north -= g0 * g2 / s
    learned.east_var -= g1 * g1 / s
    learned.east_north -= g1 * g2 / s
    learned.north_var -= g2 * g2 / s
