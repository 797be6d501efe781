"""Overhead camera in the filter: poses as fixes, whose heading has a row and a gate of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import borrowing
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED, POSITION_FLOOR_M
from touchline.onboard.estimation.tail import likelihood_of_one
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply
from touchline.onboard.filter_model import (
    GATE_1_DOF,
    HEADING,
    POSE_DOF,
    STATES,
    YAW_RATE,
    FilterCounters,
    FilterFigures,
    FixInTick,
)
from touchline.onboard.interface import CameraSample
from touchline.schemas.onboard import OnboardConfig

_HEADING_FLOOR_RAD = 0.002

Floats = NDArray[np.float64]


def camera_figures(c: FilterFigures, config: OnboardConfig) -> None:
    """Fill in the noise figures of the camera.

    Args:
        c: Figures of the filter, updated.
        config: Configuration, which has the data sheet.
    """
    c.r_gnss, c.fix_dof = max(config.camera.white_m, POSITION_FLOOR_M) ** 2, POSE_DOF
    c.r_heading = max(config.camera.white_rad, _HEADING_FLOOR_RAD) ** 2


def fix_of(pose: CameraSample) -> tuple[float, ...]:
    """Return the fields of `ReceivedFix` for a pose, which counts as fixed."""
    position = pose.stamp_s, pose.east_m, pose.north_m, pose.sigma_m**2
    return *position, FIX_FIXED, 0, 0.0, pose.heading_rad, pose.sigma_rad**2


@borrowing
def heading_row(at: TickEstimate, fix: FixInTick, row: Floats) -> tuple[float, float]:
    """Return innovation and variance, and fill in the Jacobian, of the heading of a pose.

    Args:
        at: Tick in which the pose is valid, some time before its stamp.
        fix: Pose, as a fix with a heading.
        row: (STATES,) filled in with the Jacobian.

    Returns:
        The innovation [rad] and its variance [rad²].
    """
    x, P, _ = at
    after = fix.after_s
    for k in range(STATES):
        row[k] = 0.0
    row[HEADING], row[YAW_RATE] = 1.0, after
    known = P[HEADING, HEADING] + 2.0 * after * P[HEADING, YAW_RATE] + after * after * P[YAW_RATE, YAW_RATE]
    return wrapped(fix.heading_rad - x[HEADING] - x[YAW_RATE] * after), known + fix.heading_variance_rad2


@borrowing
def share_of_poses(share: float, at: TickEstimate, fix: FixInTick, n: FilterCounters, row: Floats) -> float:
    """Return an upper bound (Bonferroni) of the share of honest poses that err as much in position or heading.

    Args:
        share: Share of honest positions that err at least as much.
        at: Tick in which the pose is valid.
        fix: Pose, as a fix with a heading.
        n: Counters; the heading is counted.
        row: (STATES,) overwritten.
    """
    turn, variance = heading_row(at, fix, row)
    nis = turn * turn / variance
    n.headings += 1
    n.heading_nis_sum += nis
    if nis > GATE_1_DOF:
        n.headings_rejected += 1
    both: float = min(2.0 * min(share, likelihood_of_one(nis)), 1.0)
    return both


@borrowing
def use_heading(at: TickEstimate, fix: FixInTick, weighed_m2: float, scratch: Scratch) -> None:
    """Update the tick in which a pose is valid with its heading, behind a gate.

    The gate is one of the heading alone: a robot that is seen the wrong way round is at its place.

    Args:
        at: Tick, whose state and covariance are updated.
        fix: Pose, as a fix with a heading.
        weighed_m2: Variance with which the position was weighed; a wild position makes the heading worse, too.
        scratch: Overwritten.
    """
    x, P, _ = at
    h, g, _ = scratch
    turn, variance = heading_row(at, fix, h[0])
    if turn * turn <= GATE_1_DOF * variance:
        apply(x, P, h[0], turn, fix.heading_variance_rad2 * max(weighed_m2 / fix.variance_m2, 1.0), g, STATES)
