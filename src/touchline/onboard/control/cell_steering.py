"""Compiled: steers a robot that can turn on the spot to a target, by its cell's rule of motion.

The rule: a step is taken only if afterwards the place and the point where braking would end are in the cell; else the
robot brakes straight ahead, which a convex cell always permits (proof: docs/explanation/teams.md).
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
# Of a robot's motion: place (m), heading (rad), commanded speed (m/s, at least 0).
X, Y, HEADING, SPEED = range(4)
# Turning: the rate per radian of bearing (1/s), and the bearing beyond which it turns on the spot (rad).
_TURN_1PS: Final = 4.0
_ASIDE_RAD: Final = 0.8
# So much of the speed from which it could just stop at the target is driven.
_SHARE: Final = 0.9


class SteeringLimits(NamedTuple):
    """What a robot can do, and how exactly it keeps to its target.

    Attributes:
        speed_max_mps: Largest speed.
        acceleration_mps2: By which it speeds up and brakes.
        lateral_acceleration_mps2: Largest, in a bend.
        yaw_rate_max_radps: Largest yaw rate.
        there_m: This near to its target it stands…
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
    """The twist for the next tick: towards the target, else the same at less speed, else braking straight ahead.

    Args:
        motion: (4,) X to SPEED.
        stands: Whether the robot has come to a target and stands.
        rows: (k, 3) half-planes of the cell.
        target: Where to go (m).
        limits: What the robot can do.
        tick_s: How long the twist is in force.

    Returns:
        Speed at the end of the tick (m/s), yaw rate (rad/s), and whether the robot stands, having come to its target.
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
