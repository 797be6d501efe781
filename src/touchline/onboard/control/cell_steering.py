"""Steering to a target by the rule of motion in a buffered cell, for a robot that can turn on the spot; compiled.

The rule: a step is taken only if afterwards the robot's place and the point where braking would end are in the cell;
otherwise the robot brakes straight ahead, which a convex cell always permits (proof: docs/explanation/teams.md).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.arcs import unit
from touchline.core.half_planes import permits
from touchline.core.jit import kernel

Floats = NDArray[np.float64]
# Motion of a robot: place (m), heading (rad), commanded speed (m/s, at least 0).
X, Y, HEADING, SPEED = range(4)
# Turning: the rate per radian of bearing (1/s), and the bearing beyond which the robot turns on the spot (rad).
_TURN_1PS: Final = 4.0
_ASIDE_RAD: Final = 0.8
# Share of the speed from which the robot could just stop at the target.
_SHARE: Final = 0.9


class SteeringLimits(NamedTuple):
    """Limits of a robot's motion, and how exactly it reaches its target.

    Attributes:
        speed_max_mps: Largest speed.
        acceleration_mps2: Acceleration and deceleration.
        lateral_acceleration_mps2: Largest lateral acceleration.
        yaw_rate_max_radps: Largest yaw rate.
        there_m: Distance to the target within which the robot stands…
        away_m: …until the target is this far away.
    """

    speed_max_mps: float
    acceleration_mps2: float
    lateral_acceleration_mps2: float
    yaw_rate_max_radps: float
    there_m: float
    away_m: float


@kernel
def steer_in_cell(
    motion: Floats, stands: bool, rows: Floats, target: complex, limits: SteeringLimits, tick_s: float
) -> tuple[float, float, bool]:
    """Compute the twist for the next tick: to the target, else the same at less speed, else braking straight ahead.

    Args:
        motion: (4,) X to SPEED.
        stands: True if the robot has reached a target and stands.
        rows: (k, 3) half-planes of the cell.
        target: Place to drive to (m).
        limits: Limits of the motion.
        tick_s: Duration of the twist.

    Returns:
        Speed at the end of the tick (m/s), yaw rate (rad/s), and True if the robot has reached its target and stands.
    """
    here, heading, speed = complex(motion[X], motion[Y]), motion[HEADING], motion[SPEED]
    way = target - here
    far = abs(way)
    there = far <= (limits.away_m if stands else limits.there_m)
    aside = 0.0 if there else wrapped(math.atan2(way.imag, way.real) - heading)
    fastest = min(limits.yaw_rate_max_radps, limits.lateral_acceleration_mps2 / max(speed, 1e-3))
    rate = min(max(_TURN_1PS * aside, -fastest), fastest)
    braking = limits.acceleration_mps2
    wanted = min(limits.speed_max_mps, _SHARE * math.sqrt(2.0 * braking * far)) * math.cos(aside)
    if there or abs(aside) > _ASIDE_RAD:
        wanted = 0.0
    gain = braking * tick_s
    for attempt in range(2):
        asked = wanted if attempt == 0 else 0.0
        after = min(max(asked, speed - gain, 0.0), speed + gain)
        moved = here + unit(heading + 0.5 * rate * tick_s) * (0.5 * (speed + after) * tick_s)
        turned = heading + rate * tick_s
        if permits(rows, here, moved, moved + unit(turned) * (after * after / (2.0 * braking))):
            return after, rate, there and after == 0.0
    return max(speed - gain, 0.0), 0.0, False
