"""Pure pursuit on the error against the path, with curvature feed-forward and PID terms.

Plain pure pursuit aims at a point of the path and therefore cuts every change of curvature. Here the path's own
curvature is fed forward, taken as far ahead as the motors lag, and the pursuit acts on what is left: in the frame that
moves with the path the point to aim at lies `lookahead` ahead on the axis, the robot `lateral` beside it and turned by
the heading error. The circle through it has curvature 2·sin α / lookahead (Coulter 1992), with α from atan2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S
from services.robot_sim.onboard.followers.wheels import Wheels, lead_ticks
from services.robot_sim.onboard.tracking import (
    A_YAW_RATE,
    HEADING_ERROR,
    LATERAL,
    LEFT_RADIUS,
    NOZZLE_LATERAL,
    REFERENCE_SPEED,
    RIGHT_RADIUS,
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


class PurePursuitFollower:
    """See the module."""

    name = "pure-pursuit"
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """A follower at rest."""
        self._wheels = Wheels(vehicle)
        self._lead = lead_ticks(vehicle)
        self.fallbacks = 0
        """Always 0: there is nothing simpler to fall back on."""
        self._lateral_sum = 0.0
        self._speed_sum = 0.0

    def reset(self) -> None:
        """Empty the integrators."""
        self._lateral_sum = self._speed_sum = 0.0

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> tuple[float, float]:
        """As `Follower.step`."""
        n = now.tolist()
        reference = n[REFERENCE_SPEED]
        sense = 1.0 if reference >= 0.0 else -1.0
        speed = max(abs(n[SPEED]), 0.05)
        lookahead = max(LOOKAHEAD_MIN_M, LOOKAHEAD_S * speed)
        # Driving backward mirrors the picture: the axis points the way the robot goes.
        alpha = math.atan2(-sense * n[NOZZLE_LATERAL], lookahead) - n[HEADING_ERROR]
        pursuit = sense * 2.0 * math.sin(alpha) / lookahead
        self._lateral_sum = _clip(
            self._lateral_sum - sense * LATERAL_INTEGRAL_1PM2S * n[LATERAL] * speed * TICK_S,
            LATERAL_INTEGRAL_LIMIT_1PM,
        )
        correction = pursuit + self._lateral_sum
        lead_speed, lead_yaw_rate = ahead[self._lead].tolist()
        late = float(ahead[0, A_YAW_RATE]) + reference * correction - n[YAW_RATE]
        yaw_rate = lead_yaw_rate + lead_speed * correction + YAW_RATE_GAIN * late
        lag = reference - n[SPEED]
        self._speed_sum = _clip(self._speed_sum + SPEED_INTEGRAL_1PS * lag * TICK_S, SPEED_INTEGRAL_LIMIT_MPS)
        return self._wheels.command(
            (lead_speed + SPEED_GAIN * lag + self._speed_sum, yaw_rate),
            (n[SPEED], n[YAW_RATE]),
            (n[LEFT_RADIUS], n[RIGHT_RADIUS]),
        )


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
