"""Timed reference along a cubic curve, under a law s(τ)."""

import math
from typing import Final, NamedTuple

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.poses.kernels.cubic_curve import CubicCurve, point, tangent, tangent_change
from touchline.services.planner.poses.speed_laws import SpeedLaw
from touchline_research.tracking.studied_robot import SPEED_MPS, YAW_RADPS
from touchline_research.tracking.tracking_loop import STEP_S, TimedReference

# Samples of τ at which the limits are evaluated.
PLACES: Final = 20_001
SLOWER: Final = 1.25
"""Duration relative to the minimum."""


class Motion(NamedTuple):
    """Motion along a curve at times τ (n,), for one second: positions x + iy (m), tangents, speeds, yaw rates."""

    point: Floats
    tangent: Floats
    speed: Floats
    yaw_rate: Floats


def timed_curve(curve: CubicCurve, law: SpeedLaw) -> TimedReference:
    """Time a curve, driven forward, to SLOWER times the minimum within the studied robot's limits.

    The minimum is the maximum of |p'|·s'/v_max and |dθ/ds|·s'/ω_max. It is no whole number of steps; the last sample is
    at the goal and at rest for all laws.
    """
    looked_at = _motion(curve, law, np.linspace(0.0, 1.0, PLACES))
    least_s = max(looked_at.speed.max() / SPEED_MPS, np.abs(looked_at.yaw_rate).max() / YAW_RADPS)
    duration_s = SLOWER * float(least_s)
    tau = STEP_S / duration_s * np.arange(math.ceil(duration_s / STEP_S) + 1, dtype=np.float64)
    moved = _motion(curve, law, np.minimum(tau, 1.0))
    driven = tau < 1.0
    speed, yaw_rate = driven * moved.speed / duration_s, driven * moved.yaw_rate / duration_s
    poses = np.column_stack((moved.point.real, moved.point.imag, np.unwrap(np.angle(moved.tangent))))
    return TimedReference(poses, speed, yaw_rate, np.gradient(speed, STEP_S))


def _motion(curve: CubicCurve, law: SpeedLaw, tau: Floats) -> Motion:
    s, rate = law.s(tau), law.rate(tau)
    first, second = tangent(curve, s), tangent_change(curve, s)
    stretch = np.abs(first)
    turning = (first.conjugate() * second).imag / np.square(stretch)
    return Motion(point(curve, s), first, stretch * rate, turning * rate)
