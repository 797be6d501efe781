"""Pure pursuit on the error against the path, with curvature feed-forward and PID terms.

Plain pure pursuit aims at a point of the path and therefore cuts every change of curvature. Here the path's own
curvature is fed forward, taken as far ahead as the motors lag, and the pursuit acts on what is left: in the frame that
moves with the path the point to aim at lies `lookahead` ahead on the axis, the robot `lateral` beside it and turned by
the heading error. The circle through it has curvature 2·sin α / lookahead (Coulter 1992), with α from atan2.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S
from services.robot_sim.onboard.followers.wheels import W_SIDE_SLIP, command_wheels, lead_ticks, wheel_limits
from services.robot_sim.onboard.tracking import (
    A_SPEED,
    A_YAW_RATE,
    HEADING_ERROR,
    LATERAL,
    NOZZLE_LATERAL,
    REFERENCE_SPEED,
    SPEED,
    YAW_RATE,
)

LOOKAHEAD_S = 0.30
LOOKAHEAD_MIN_M = 0.22
YAW_RATE_GAIN = 1.0
"""Yaw rate command per yaw rate error: slip and lag out of the loop before they become a heading error."""
LATERAL_INTEGRAL_1PM2S = 1.2
LATERAL_INTEGRAL_LIMIT_1PM = 0.1
SPEED_GAIN = 1.5
SPEED_INTEGRAL_1PS = 3.0
SPEED_INTEGRAL_LIMIT_MPS = 0.15

LATERAL_SUM: Final = 0  # 1/m
SPEED_SUM: Final = 1  # m/s
MEMORY: Final = 2

Floats = NDArray[np.float64]


class PurePursuitFollower:
    """See the module."""

    name = "pure-pursuit"
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """A follower at rest."""
        self.parameters = wheel_limits(vehicle)
        """(PARAMETERS,) of `wheels`."""
        self.lead = lead_ticks(vehicle)
        """Row of `ahead` that the feed-forward is taken from."""
        self.ahead_ticks = self.lead + 1
        self.memory = np.zeros(MEMORY)
        """(MEMORY,) the integrators."""
        self._wheels = np.zeros(2)
        self.fallbacks = 0
        """Always 0: there is nothing simpler to fall back on."""

    def reset(self) -> None:
        """Empty the integrators."""
        self.memory[:] = 0.0

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> tuple[float, float]:
        """As `Follower.step`."""
        pursue(now, ahead, self.lead, self.parameters, self.memory, self._wheels)
        left, right = self._wheels.tolist()
        return left, right


@kernel
def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@kernel
def pursue(now: Floats, ahead: Floats, lead: int, p: Floats, memory: Floats, wheels: Floats) -> None:
    """One tick: the wheel speeds for the errors of `now`.

    Args:
        now: (NOW,) of `tracking`.
        ahead: (more than `lead`, AHEAD_COLUMNS) of `tracking`.
        lead: By how many ticks the feed-forward is ahead.
        p: (PARAMETERS,) of `wheels`.
        memory: (MEMORY,) updated.
        wheels: (2,) filled with the commands of the left and right wheel [rad/s].
    """
    reference, speed_now = now[REFERENCE_SPEED], now[SPEED]
    sense = 1.0 if reference >= 0.0 else -1.0
    speed = max(abs(speed_now), 0.05)
    lookahead = max(LOOKAHEAD_MIN_M, LOOKAHEAD_S * speed)
    # Driving backward mirrors the picture: the axis points the way the robot goes.
    crab = p[W_SIDE_SLIP] * speed_now * ahead[0, A_YAW_RATE]  # into a curve, as much as the tyres drift out of it
    alpha = math.atan2(-sense * now[NOZZLE_LATERAL], lookahead) - (now[HEADING_ERROR] - crab)
    pursuit = sense * 2.0 * math.sin(alpha) / lookahead
    memory[LATERAL_SUM] = _clip(
        memory[LATERAL_SUM] - sense * LATERAL_INTEGRAL_1PM2S * now[LATERAL] * speed * TICK_S,
        LATERAL_INTEGRAL_LIMIT_1PM,
    )
    correction = pursuit + memory[LATERAL_SUM]
    lead_speed, lead_yaw_rate = ahead[lead, A_SPEED], ahead[lead, A_YAW_RATE]
    late = ahead[0, A_YAW_RATE] + reference * correction - now[YAW_RATE]
    yaw_rate = lead_yaw_rate + lead_speed * correction + YAW_RATE_GAIN * late
    lag = reference - speed_now
    memory[SPEED_SUM] = _clip(memory[SPEED_SUM] + SPEED_INTEGRAL_1PS * lag * TICK_S, SPEED_INTEGRAL_LIMIT_MPS)
    command_wheels(lead_speed + SPEED_GAIN * lag + memory[SPEED_SUM], yaw_rate, now, p, wheels)
