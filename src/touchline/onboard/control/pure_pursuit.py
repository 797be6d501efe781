"""Pure pursuit on the error against the path, with curvature feed-forward and PID terms.

Plain pure pursuit aims at a point of the path and therefore cuts every change of curvature. Here the path's own
curvature is fed forward, taken ahead by the lag of the motors, and the pursuit acts on the remaining error: in the
frame that moves with the path the target point lies `lookahead` ahead on the axis, the robot `lateral` beside it and
turned by the heading error. The circle through it has curvature 2·sin α / lookahead (Coulter 1992), with α from atan2.

The speed is the reference's unless the path ahead forbids it. Then it is regulated, in the sense of Regulated Pure
Pursuit (Macenski et al. 2023) with this robot's own measures: by the lateral acceleration of the curvature commanded
now and of the path's within a braking distance, which the tyres have to hold, and by the nozzle's distance from its
line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.records import Record
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.drives.onboard_drive import Aim, drive_of
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import (
    HEADING_ERROR,
    LATERAL,
    NOZZLE_LATERAL,
    REFERENCE_SPEED,
    SPEED,
    YAW_RATE,
)
from touchline.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE, COARSE_TICKS
from touchline.schemas.vehicles import Vehicle

YAW_RATE_GAIN = 1.0
"""Yaw rate command per yaw rate error: removes slip and lag from the loop before they become a heading error."""
LATERAL_INTEGRAL_LIMIT_1PM = 0.1
SPEED_GAIN = 1.5
SPEED_INTEGRAL_1PS = 3.0
SPEED_INTEGRAL_LIMIT_MPS = 0.15
ACROSS_MARGIN = 1.25
"""Factor on the planned lateral acceleration that commanded curvature may reach: a plan at its limit can be
corrected."""
PREVIEW_TICKS = 28
"""Preview of curves: from 1.5 m/s it takes as long to brake for a radius of 1 m."""
NEAR_M, FAR_M = 0.05, 0.20
"""Distances of the nozzle from its line at which the robot begins to slow down, and is at its slowest."""
SLOWEST_MPS = 0.3
"""Speed below which no reference is reduced."""
REDUCE_MPS2 = 3.0
"""Largest rate of the reduction, should the estimate jump."""

Floats = NDArray[np.float64]


class PursuitLimits(NamedTuple):
    """Limits of the vehicle for pure pursuit.

    Attributes:
        side_slip_rad_per_mps2: Nominal side slip angle per lateral acceleration.
        across_mps2: Largest planned lateral acceleration.
        brake_mps2: Largest planned deceleration along the path.
        aim: Lookahead.
    """

    side_slip_rad_per_mps2: float
    across_mps2: float
    brake_mps2: float
    aim: Aim = Aim()


class PursuitMemory(Record):
    """Memory of pure pursuit from tick to tick: the integrators, and the reduction of the speed."""

    lateral_sum_1pm: float
    speed_sum_mps: float
    reduction_mps: float
    """Reduction of the reference speed."""


class PurePursuitFollower:
    """Follower by regulated pure pursuit with feed-forward."""

    name = "pure-pursuit"
    can_fail = False
    timed = False
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """Make a follower at rest."""
        drive = drive_of(vehicle)
        self.limits = PursuitLimits(
            drive.side_slip_rad_per_mps2,
            vehicle.drive.max_lateral_acceleration_mps2,
            vehicle.drive.max_acceleration_mps2,
            drive.aim,
        )
        self.lead = lead_ticks(drive.lag_s)
        """Row of `ahead` that the feed-forward is taken from."""
        self.fine_rows = self.lead + 1
        self.ahead_rows = self.fine_rows + max(0, math.ceil((PREVIEW_TICKS - self.fine_rows) / COARSE_TICKS))
        self.memory = PursuitMemory()
        self._twist = np.zeros(2)
        self.fallbacks = 0
        """Always 0: there is no simpler method to fall back on."""

    def reset(self) -> None:
        """Empty the integrators, and end a reduction of the speed."""
        self.memory.reset()

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """See `Follower.step`."""
        pursue(now, ahead, self.lead, self.limits, self.memory.array, self._twist)
        speed_mps, yaw_rate_radps = self._twist.tolist()
        return BodyTwist(speed_mps, yaw_rate_radps)


@kernel
def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@kernel
def _allowed_mps(
    reference: float, correction: float, off_m: float, ahead: Floats, lead: int, p: PursuitLimits
) -> float:
    """Return the speed [m/s] up to `reference` (all unsigned) that curvature and distance from the line allow."""
    allowed = reference
    most = ACROSS_MARGIN * p.across_mps2
    speed, yaw_rate = abs(ahead[lead, A_SPEED]), ahead[lead, A_YAW_RATE]
    sense = 1.0 if ahead[lead, A_SPEED] >= 0.0 else -1.0
    across = abs(sense * yaw_rate + speed * correction) * speed
    if across > most:
        allowed = min(allowed, speed * math.sqrt(most / across))
    distance_m = 0.0
    for i in range(ahead.shape[0]):
        speed = abs(ahead[i, A_SPEED])
        across = abs(ahead[i, A_YAW_RATE]) * speed
        if across > most:
            allowed = min(allowed, math.sqrt(speed * speed * most / across + 2.0 * p.brake_mps2 * distance_m))
        distance_m += speed * (TICK_S if i <= lead else COARSE_TICKS * TICK_S)
    if off_m > NEAR_M:
        far = min((off_m - NEAR_M) / (FAR_M - NEAR_M), 1.0)
        allowed = min(allowed, reference - far * (reference - SLOWEST_MPS))
    return max(allowed, min(reference, SLOWEST_MPS))


@kernel
def pursue(
    now: Floats, ahead: Floats, lead: int, p: PursuitLimits, memory: Sequence[PursuitMemory], twist: Floats
) -> None:
    """Compute the twist for the coming tick.

    Args:
        now: (NOW,) of `tracking_state`.
        ahead: (more than `lead`, AHEAD_COLUMNS) of `path_projection`, up to row `lead` by ticks, then by COARSE_TICKS.
        lead: Lead of the feed-forward in ticks.
        p: Limits of the vehicle.
        memory: (1,) updated.
        twist: (2,) filled with speed [m/s] and yaw rate [rad/s].
    """
    kept, reference, speed_now = memory[0], now[REFERENCE_SPEED], now[SPEED]
    sense = 1.0 if reference >= 0.0 else -1.0
    speed = max(abs(speed_now), 0.05)
    lookahead = max(p.aim.lookahead_min_m, p.aim.lookahead_s * speed)
    # Driving backward mirrors the picture: the axis points in the direction of travel.
    crab = p.side_slip_rad_per_mps2 * speed_now * ahead[0, A_YAW_RATE]  # into a curve, by the drift angle of the tyres
    alpha = math.atan2(-sense * now[NOZZLE_LATERAL], lookahead) - (now[HEADING_ERROR] - crab)
    pursuit = sense * 2.0 * math.sin(alpha) / lookahead
    kept.lateral_sum_1pm = _clip(
        kept.lateral_sum_1pm - sense * p.aim.lateral_integral_1pm2s * now[LATERAL] * speed * TICK_S,
        LATERAL_INTEGRAL_LIMIT_1PM,
    )
    correction = pursuit + kept.lateral_sum_1pm
    wanted = abs(reference)
    # `correction` is of the path's curvature; driving backward, that of the rows is mirrored, too.
    allowed = _allowed_mps(wanted, sense * correction, abs(now[NOZZLE_LATERAL]), ahead, lead, p)
    before = kept.reduction_mps
    reduction = min(max(wanted - allowed, before - p.brake_mps2 * TICK_S, 0.0), before + REDUCE_MPS2 * TICK_S)
    kept.reduction_mps = reduction
    share = max(wanted - reduction, min(wanted, SLOWEST_MPS)) / wanted if reduction > 0.0 and wanted > 0.0 else 1.0
    reference *= share
    lead_speed, lead_yaw_rate = share * ahead[lead, A_SPEED], share * ahead[lead, A_YAW_RATE]
    late = share * ahead[0, A_YAW_RATE] + reference * correction - now[YAW_RATE]
    yaw_rate = lead_yaw_rate + lead_speed * correction + YAW_RATE_GAIN * late
    lag = reference - speed_now
    kept.speed_sum_mps = _clip(kept.speed_sum_mps + SPEED_INTEGRAL_1PS * lag * TICK_S, SPEED_INTEGRAL_LIMIT_MPS)
    twist[0], twist[1] = lead_speed + SPEED_GAIN * lag + kept.speed_sum_mps, yaw_rate
