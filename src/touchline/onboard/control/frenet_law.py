"""Path law of Samson and Micaelli: steers by the distance from the path and the angle to it."""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.core.angles import sinc
from touchline.core.jit import kernel

MIN_STRETCH = 0.05
"""Lower bound of the divisor 1 − c·l: the robot is then almost at the centre of the path's curvature."""


class FrenetLaw(NamedTuple):
    """Gains of ω = v·cos δ·c/(1 − c·l) − k_a·v·l·(sin δ/δ) − k_b·δ.

    With l the distance to the left of the path, δ the heading less the path's and c its curvature, left positive, ds/dt
    = v·cos δ/(1 − c·l) and dl/dt = v·sin δ. V = ½k_a·l² + ½δ² then falls by V̇ = −k_b·δ² (C. Samson and A. Micaelli,
    "Trajectory tracking for unicycle-type and two-steering-wheels mobile robots", INRIA report 2097, 1993). Near the
    path l is an oscillator of natural frequency v·√k_a, damped by k_b/(2v·√k_a).

    Attributes:
        k_a_1pm2: Gain of the distance.
        k_b_1ps: Gain of the angle.
    """

    k_a_1pm2: float
    k_b_1ps: float


@kernel
def path_yaw_rate_radps(
    law: FrenetLaw, lateral_m: float, angle_rad: float, curvature_1pm: float, speed_mps: float
) -> float:
    """Compute the yaw rate of a robot beside the path.

    Args:
        law: Gains of the law.
        lateral_m: l.
        angle_rad: δ.
        curvature_1pm: c, of the path in the robot's forward direction.
        speed_mps: v, negative if the robot drives backward.
    """
    stretch = max(1.0 - curvature_1pm * lateral_m, MIN_STRETCH)
    forward = speed_mps * math.cos(angle_rad) * curvature_1pm / stretch
    pull = law.k_a_1pm2 * speed_mps * lateral_m * float(sinc(angle_rad))
    return forward - pull - law.k_b_1ps * angle_rad
