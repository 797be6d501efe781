"""Steering along a committed plan, compiled: to the place where the plan is now, not to a place somewhere on its path.

The law is that of Kanayama, Kimura, Miyazaki, Noguchi, "A stable tracking control method for an autonomous mobile
robot", ICRA 1990: v = v_r·cos e_θ + k_x·e_x, ω = ω_r + v_r·k_y·e_y + k_θ·sin e_θ, errors in the robot's frame. The pose
is the one at which the actuators have caught up, so the robot itself is late by their lag, and all robots of a team
alike: that changes no distance between them.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.core.timed_motion import HEADING, SPEED, YAW_RATE, X, Y
from touchline.onboard.control.cell_steering import SteeringLimits

Floats = NDArray[np.float64]

_ALONG_1PS: Final = 2.0
_ACROSS_1PM2: Final = 12.0
_HEADING_1PS: Final = 4.0
_CATCHING_UP: Final = 1.2
"""Factors on the limits of speed and acceleration, so that a robot behind its plan can catch up."""
# Errors with which a robot whose plan is at rest stands, instead of creeping after its estimate.
_STANDS_M: Final = 0.005
_STANDS_RAD: Final = 0.03


@kernel
def follow_plan(motion: Floats, planned: Floats, limits: SteeringLimits, tick_s: float) -> tuple[float, float]:
    """Compute the twist for the next tick.

    Args:
        motion: (4,) X to SPEED: where the robot is once its actuators have caught up.
        planned: (5,) X to YAW_RATE: where it should be.
        limits: Limits of its motion.
        tick_s: Duration of the twist.

    Returns:
        Speed (m/s, at least 0) and yaw rate (rad/s).
    """
    off = complex(planned[X] - motion[X], planned[Y] - motion[Y]) * unit(-motion[HEADING])
    turn = planned[HEADING] - motion[HEADING]
    wanted = planned[SPEED] * math.cos(turn) + _ALONG_1PS * off.real
    gain = _CATCHING_UP * limits.acceleration_mps2 * tick_s
    rests = planned[SPEED] == 0.0 and planned[YAW_RATE] == 0.0
    if rests and abs(off) <= _STANDS_M and abs(turn) <= _STANDS_RAD:
        return max(motion[SPEED] - gain, 0.0), 0.0
    speed = min(max(wanted, motion[SPEED] - gain, 0.0), motion[SPEED] + gain, _CATCHING_UP * limits.speed_max_mps)
    rate = planned[YAW_RATE] + planned[SPEED] * _ACROSS_1PM2 * off.imag + _HEADING_1PS * math.sin(turn)
    return speed, min(max(rate, -limits.yaw_rate_max_radps), limits.yaw_rate_max_radps)
