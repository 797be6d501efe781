"""GNSS in the filter: position fixes of the antenna, with a slow error and a heavy-tailed white one.

Positions of the overhead camera take the same way. It sees the body itself: arm, mast and slow error are zero.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.computer_state import FilterState, ReceivedFix
from touchline.onboard.estimation.adaptation import add_stray
from touchline.onboard.estimation.calibration import WAVE_SAMPLES
from touchline.onboard.estimation.gauss_markov import position_error
from touchline.onboard.estimation.learned_constants import start_variance
from touchline.onboard.estimation.tail import (
    BURST_SHARE,
    bounded,
    doubt,
    likelihood,
    likelihood_in_burst,
    weighed_variance,
)
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply_two, nis_of_two, whitened
from touchline.onboard.filter_model import (
    ANTENNA_X,
    ANTENNA_Y,
    EAST,
    FIX_DOF,
    GNSS_EAST,
    GNSS_NORTH,
    HEADING,
    NORTH,
    SPEED,
    STAMP_OFFSET,
    STATES,
    YAW_RATE,
    FilterCounters,
    FilterFigures,
    FixInTick,
    TickInputs,
)
from touchline.onboard.interface import TICK_S
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle

FIX_NONE: Final = 0
FIX_FLOAT: Final = 2
FIX_FIXED: Final = 3
POSITION_FLOOR_M: Final = 0.002
"""Smallest standard deviation of a position that is believed."""
_LOOSE_FIX_FACTOR = 20.0  # float and single fixes err slowly: their variance counts for two seconds, not for 0.1 s
_SINGLE_FIX_FLOOR_M2 = 1.0
_FLOAT_FIX_FLOOR_M2 = 0.04
_CONSTANT_WALK_RTS = 8e-5  # 2 mm, and 2 ms, in ten minutes [assumed]: a mast gives way, a receiver's load changes
_RECENT = 0.1  # weight of the newest fix in the running NIS
_BURST_TAU = 0.5  # time constant in a burst against that of the part with bursts and without

Floats = NDArray[np.float64]


def gnss_figures(c: FilterFigures, vehicle: Vehicle, config: OnboardConfig) -> None:
    """Fill in the noise figures of the GNSS receiver, and the place of its antenna.

    Args:
        c: Figures of the filter, updated.
        vehicle: Vehicle, which has the antenna.
        config: Configuration, which has the data sheet.
    """
    gnss, body = config.gnss, vehicle.body
    c.antenna_x_m, c.antenna_y_m = body.gnss_antenna_x_m, body.gnss_antenna_y_m
    c.mast_s2 = body.gnss_antenna_z_m / GRAVITY_MPS2
    error = position_error(
        (
            (gnss.gauss_markov_1_m, gnss.gauss_markov_1_tau_s),
            (gnss.gauss_markov_2_m, gnss.gauss_markov_2_tau_s),
        )
    )
    c.gnss_var, c.gnss_decay = error.variance, math.exp(-TICK_S / error.tau_s)
    c.slow_var, c.q_slow = error.slow_variance, 2.0 * error.slow_variance * TICK_S / error.slow_tau_s
    if error.slow_variance > 0.0:
        c.burst_var = error.variance / BURST_SHARE
        left = math.exp(-1.0 / (gnss.rate_hz * _BURST_TAU * error.tau_s))
        c.fix_news = (1.0 - left) / (1.0 + left)
    c.stamp_offset_s = gnss.stamp_offset_s
    known = config.calibrated
    c.constant_var[1] = start_variance(1, gnss.antenna_sigma_m, known.antenna)
    c.constant_var[2] = start_variance(2, gnss.antenna_sigma_m, known.antenna)
    c.constant_var[3] = start_variance(3, gnss.stamp_offset_sigma_s, known.stamp_offset)
    c.q_constant[1:] = (_CONSTANT_WALK_RTS**2 * TICK_S,) * 3
    c.r_gnss, c.fix_dof = max(gnss.white_m, POSITION_FLOOR_M) ** 2, FIX_DOF


@kernel
def enter_fix(fix: ReceivedFix, ring: FilterState) -> int:
    """Enter a fix in `ring.arrived`, with the variance of its white part.

    Args:
        fix: Fix, or pose of a camera, that has arrived.
        ring: State of the filter, updated.

    Returns:
        Tick in which the fix is valid, or less than a tick after which it is.
    """
    c, entered = ring.figures, ring.arrived
    measured_s = fix.stamp_s + c.stamp_offset_s
    tick: int = math.floor(measured_s / TICK_S + 1e-6)
    entered.east_m, entered.north_m = fix.east_m, fix.north_m
    entered.after_s = measured_s - tick * TICK_S
    entered.heading_rad, entered.strayed_m = fix.heading_rad, 0.0
    entered.heading_variance_rad2 = max(fix.heading_variance_rad2, c.r_heading)
    if fix.fix == FIX_FIXED:
        # What the receiver reports beyond its data sheet is trouble; what it reports less is not believed.
        excess = fix.variance_m2 - c.r_gnss - c.gnss_var - c.slow_var
        entered.variance_m2 = c.r_gnss + max(excess, 0.0)
    else:
        floor = _FLOAT_FIX_FLOOR_M2 if fix.fix == FIX_FLOAT else _SINGLE_FIX_FLOOR_M2
        entered.variance_m2 = _LOOSE_FIX_FACTOR * max(fix.variance_m2, floor)
    return tick


@borrowing
def add_sway(fix: FixInTick, z: TickInputs, c: FilterFigures) -> None:
    """Add to the variance of a fix that of the antenna, whose mast sways on waves of the ground.

    Args:
        fix: The fix, updated.
        z: Inputs of the tick in which it is valid.
        c: Figures of the filter.
    """
    fix.variance_m2 += WAVE_SAMPLES * c.mast_s2 * c.mast_s2 * z.waves_var


@borrowing
def fix_rows(at: TickEstimate, fix: FixInTick, c: FilterFigures, h: Floats) -> tuple[float, float]:
    """Return innovations and fill in the Jacobian of a fix: place of the antenna, whose mast leans with the ground.

    Args:
        at: Tick in which the fix is valid, some time before its stamp.
        fix: The fix.
        c: Figures of the filter.
        h: (2, STATES) filled in with the Jacobian of east and north.

    Returns:
        Innovations east and north [m].
    """
    x, _, z = at
    after = fix.after_s + x[STAMP_OFFSET]
    heading = x[HEADING] + x[YAW_RATE] * after
    cos, sin = math.cos(heading), math.sin(heading)
    forward_m, left_m = c.antenna_x_m + x[ANTENNA_X], c.antenna_y_m + x[ANTENNA_Y]
    arm_e = forward_m * cos - left_m * sin
    arm_n = forward_m * sin + left_m * cos
    ahead = x[SPEED] * after
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    h[0, EAST], h[0, GNSS_EAST] = 1.0, 1.0
    h[1, NORTH], h[1, GNSS_NORTH] = 1.0, 1.0
    h[0, HEADING], h[1, HEADING] = -arm_n - ahead * sin, arm_e + ahead * cos
    h[0, SPEED], h[1, SPEED] = after * cos, after * sin
    h[0, YAW_RATE], h[1, YAW_RATE] = -arm_n * after, arm_e * after
    h[0, ANTENNA_X], h[1, ANTENNA_X] = cos, sin
    h[0, ANTENNA_Y], h[1, ANTENNA_Y] = -sin, cos
    h[0, STAMP_OFFSET] = x[SPEED] * cos - x[YAW_RATE] * arm_n
    h[1, STAMP_OFFSET] = x[SPEED] * sin + x[YAW_RATE] * arm_e
    return (
        fix.east_m - (x[EAST] + ahead * cos + arm_e - c.mast_s2 * z.rise_east_mps2 + x[GNSS_EAST]),
        fix.north_m - (x[NORTH] + ahead * sin + arm_n - c.mast_s2 * z.rise_north_mps2 + x[GNSS_NORTH]),
    )


@borrowing
def position_fit(
    at: TickEstimate, fix: FixInTick, c: FilterFigures, n: FilterCounters, h: Floats
) -> tuple[float, float]:
    """Compare a fix with the estimate.

    Args:
        at: Tick in which the fix is valid.
        fix: The fix.
        c: Figures of the filter.
        n: Counters; the last innovation is noted.
        h: (2, STATES) overwritten.

    Returns:
        Normalised innovation squared (NIS), bounded as in `tail.bounded`, against what bursts explain, and the share of
        an honest receiver's fixes that err at least as much.
    """
    y = fix_rows(at, fix, c, h)
    nis = nis_of_two(at.P, h, y, fix.variance_m2)
    weighed = bounded(nis, c.fix_dof)
    n.fix_step_m = math.hypot(y[0] - n.innovation_east_m, y[1] - n.innovation_north_m)
    n.innovation_east_m, n.innovation_north_m, n.fix_nis_last = y[0], y[1], weighed
    n.fix_white_0, n.fix_white_1, n.fix_log_det = whitened(at.P, h, y, fix.variance_m2)
    if c.burst_var == 0.0:
        return weighed, likelihood(nis, c.fix_dof)
    nis = nis_of_two(at.P, h, y, fix.variance_m2 + c.burst_var)
    return bounded(nis, c.fix_dof), likelihood_in_burst(nis)


@borrowing
def set_slow_error_aside(P: Floats, variance: float) -> None:
    """Subtract the slow error that all positions share from the covariance, for their update; add it with a minus.

    It is considered (`prediction.add_scale_error` has the source): the position that fixes tell is the true one plus
    that error, whose variance they cannot reduce.

    Args:
        P: (STATES, STATES) covariance of the state, updated.
        variance: Variance of that error [m²].
    """
    P[EAST, EAST] -= variance
    P[NORTH, NORTH] -= variance


@kernel
def passes_doubt(c: FilterFigures, n: FilterCounters, nis: float, share: float) -> bool:
    """Return whether a fix is to be used; it is not if the run of outlying fixes that it ends is no chance.

    Args:
        c: Figures of the filter.
        n: Counters, updated.
        nis: Bounded NIS of the fix, against what bursts explain.
        share: Share of honest fixes that err at least as much.
    """
    n.fix_doubt = doubt(n.fix_doubt, share, c.fix_news)
    n.fixes_outlying_run = n.fixes_outlying_run + 1 if n.fix_doubt > 0.0 else 0
    n.outlying_step_m = max(n.outlying_step_m, n.fix_step_m) if n.fixes_outlying_run > 0 else 0.0
    if n.fix_doubt >= c.fix_doubt_most:
        n.fixes_rejected += 1
        return False
    n.fixes += 1
    n.fix_nis_sum += n.fix_nis_last
    n.fix_nis_recent += _RECENT * (nis - n.fix_nis_recent)
    return True


@borrowing
def use_position(at: TickEstimate, fix: FixInTick, c: FilterFigures, scratch: Scratch) -> float:
    """Update the tick in which a fix is valid with its position.

    Args:
        at: Tick, whose state and covariance are updated.
        fix: The fix.
        c: Figures of the filter.
        scratch: Overwritten.

    Returns:
        Variance with which the fix was weighed [m²], of `tail.weighed_variance`.
    """
    x, P, _ = at
    h, _ = scratch
    y = fix_rows(at, fix, c, h)
    if fix.strayed_m > 0.0:
        add_stray(P, fix)
    weighed: float = weighed_variance(P, h, y, fix.variance_m2, c.fix_dof)
    apply_two(x, P, scratch, y, weighed, STATES, c.considered)
    return weighed
