"""Covariance of the pose that the robot claims: the filter's, and what is not known of the ground's slope.

Fixes tell where the antenna is and in which direction the robot moves. On a slope the mast leans downhill and the robot
drifts by an angle, and any robot may drive a little aside of where it heads: the axle's place and the heading are as
uncertain as these. The slope, which is learned beside the states, and that angle are considered (S. F. Schmidt,
"Application of State-Space Methods to Navigation Problems", Advances in Control Systems 3, 1966).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import Computer, ComputerState

Floats = NDArray[np.float64]


@kernel
def claim(c: ComputerState, row: Floats) -> None:
    """Fill in the covariance of the newest pose.

    Args:
        c: State with an estimate.
        row: (9,) filled in, row by row: east [m], north [m], heading [rad].
    """
    slot, learned, mast = c.times.tick % m.RING, c.filter.learned, c.filter.figures.mast_s2
    by_east, by_north = _drift(c)
    for i in range(3):
        for k in range(3):
            row[3 * i + k] = c.filter.covariances[slot, i, k]
    row[0] += mast * mast * learned.east_var
    row[1] += mast * mast * learned.east_north
    row[4] += mast * mast * learned.north_var
    row[2] += mast * (by_east * learned.east_var + by_north * learned.east_north)
    row[5] += mast * (by_east * learned.east_north + by_north * learned.north_var)
    row[8] = _course_variance(c, by_east, by_north) + c.filter.figures.crab_var
    row[3], row[6], row[7] = row[1], row[2], row[5]


@kernel
def claim_pose(computer: Computer, row: Floats) -> None:
    """Fill in the covariance of the newest pose, as `claim` does; `computer` is (1,)."""
    claim(computer[0], row)


@kernel
def claimed_position_sigma(c: ComputerState) -> float:
    """Return the larger σ of the two axes [m].

    Args:
        c: State with an estimate.
    """
    east, north, _ = _position_covariance(c)
    return math.sqrt(max(east, north))


@kernel
def largest_position_variance(c: ComputerState) -> float:
    """Return the variance in the direction in which it is largest [m²].

    Args:
        c: State with an estimate.
    """
    east, north, both = _position_covariance(c)
    variance_m2: float = 0.5 * (east + north) + math.hypot(0.5 * (east - north), both)
    return variance_m2


@kernel
def claimed_heading_sigma(c: ComputerState) -> float:
    """Return σ of the heading [rad].

    Args:
        c: State with an estimate.
    """
    by_east, by_north = _drift(c)
    return math.sqrt(_course_variance(c, by_east, by_north) + c.filter.figures.crab_var)


@kernel
def course_sigma(c: ComputerState) -> float:
    """Return σ of the heading that the robot has if it drives where it heads [rad]: what driving improves.

    Args:
        c: State with an estimate.
    """
    by_east, by_north = _drift(c)
    return math.sqrt(_course_variance(c, by_east, by_north))


@kernel
def _position_covariance(c: ComputerState) -> tuple[float, float, float]:
    """Return the variances east and north, and their covariance [m²]."""
    P, learned, mast = c.filter.covariances[c.times.tick % m.RING], c.filter.learned, c.filter.figures.mast_s2
    return (
        P[m.EAST, m.EAST] + mast * mast * learned.east_var,
        P[m.NORTH, m.NORTH] + mast * mast * learned.north_var,
        P[m.EAST, m.NORTH] + mast * mast * learned.east_north,
    )


@kernel
def _drift(c: ComputerState) -> tuple[float, float]:
    """Return the change of the heading that fixes leave, by the slope east and north [rad per m/s²]."""
    x = c.filter.states[c.times.tick % m.RING]
    drift = math.copysign(c.filter.figures.side_slip_rad_per_mps2, x[m.SPEED])
    return drift * math.sin(x[m.HEADING]), -drift * math.cos(x[m.HEADING])


@kernel
def _course_variance(c: ComputerState, by_east: float, by_north: float) -> float:
    learned = c.filter.learned
    variance: float = c.filter.covariances[c.times.tick % m.RING, m.HEADING, m.HEADING]
    variance += by_east * by_east * learned.east_var + by_north * by_north * learned.north_var
    variance += 2.0 * by_east * by_north * learned.east_north
    return variance
