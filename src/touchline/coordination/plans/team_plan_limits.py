"""Limits of a team's plans, from its vehicle and its radio."""

from __future__ import annotations

import math
from typing import Final

from touchline.coordination.plans.plan_kernels import PlanLimits
from touchline.core.timed_motion import STEP_S
from touchline.schemas.team import TeamScenario

_YAW_RATE_MAX_RADPS: Final = 2.0
_TRIES_S: Final = 0.3
"""Time beyond the largest delay for which a plan is sent again and again before it is too late."""


def plan_limits(team: TeamScenario) -> PlanLimits:
    """Return the limits of a team's plans.

    A turn may take twice the acceleration of driving on at the wheels: they can do more than plans of paths ask for.
    """
    drive, links = team.vehicle.drive, team.links
    lead_s = 0.0 if links.lossless else links.delay_s + _TRIES_S
    return PlanLimits(
        speed_max_mps=drive.transit_speed_mps,
        acceleration_mps2=drive.max_acceleration_mps2,
        lateral_acceleration_mps2=drive.max_lateral_acceleration_mps2,
        yaw_rate_max_radps=min(drive.max_yaw_rate_radps, _YAW_RATE_MAX_RADPS),
        yaw_acceleration_radps2=2.0 * drive.max_acceleration_mps2 / drive.spin_lever_m,
        apart_m=2.0 * team.radius_m,
        wall_m=team.radius_m,
        lead_steps=math.ceil(lead_s / STEP_S - 1e-9),
        drive_steps=math.ceil(max(team.update_s, lead_s) / STEP_S - 1e-9),
        update_steps=round(team.update_s / STEP_S),
    )
