"""Dead reckoning of a guided robot: how far it may drive without fixes, by what a metre adds to the σ of its place.

While it has fixes, a robot drives as its guidance says. Without them for longer than to paint (`PoseLimits.fix_age_s`),
it drives only as far as its place, once it stands, is known as its team relies on; docs/explanation/teams.md has the
reasons.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import Computer
from touchline.onboard.estimation.claimed_covariance import largest_position_variance
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.onboard import DriveSheet
from touchline.schemas.vehicles.drive_spec import DriveSpec

APART_SIGMAS: Final = 3.0
"""σ of the distance of two robots without fixes that what r_s leaves beside both bodies holds."""
LEAST_WAY_M: Final = 0.01
"""Distance for which it is not worth setting off."""


class DeadReckoning(NamedTuple):
    """Limits of driving without fixes.

    Attributes:
        sigma_m: σ of the place in any direction, once the robot stands; infinite: any.
        growth_m: What a metre by the wheels alone adds to its variance (m²/m).
        way_m: Distance that the robot must be allowed to drive, or it stands.
    """

    sigma_m: float
    growth_m: float
    way_m: float


def dead_reckoning(margin_m: float, drive: DriveSpec, sheet: DriveSheet) -> DeadReckoning:
    """Return the limits of a robot.

    Errors of two robots do not depend on each other, so σ of their distance is √2 times σ of a place; `APART_SIGMAS` of
    it are the margins of both. A metre adds σ_w² to the variance sideways, and 2·σ_s²·τ·v along the way (slip with a
    correlation time τ).

    Args:
        margin_m: Distance by which the robot may be off its guidance: r_s less the radius of its body; 0: any.
        drive: The nominal robot's drive.
        sheet: Data sheet of its wheels: σ_w, σ_s and τ.
    """
    sigma_m = math.sqrt(2.0) * margin_m / APART_SIGMAS if margin_m > 0.0 else math.inf
    along_m = 2.0 * sheet.slip_relative**2 * sheet.slip_tau_s * drive.transit_speed_mps
    return DeadReckoning(sigma_m, max(sheet.side_slip_m_rtm**2, along_m), LEAST_WAY_M)


@kernel
def allowed_way_m(computer: Computer, limits: DeadReckoning) -> float:
    """Return how far the robot may drive until it must stand (m); inf while it has fixes, or needs none.

    A heading's error, which grows little meanwhile, moves the place sideways by as much per metre.

    Args:
        computer: (1,) whose tick has been evaluated.
        limits: Limits.
    """
    c = computer[0]
    age_s = c.pose.tick / TICKS_PER_S - c.times.last_used_stamp_s
    if not c.pose.needs_fixes or age_s <= c.pose.fix_age_s or math.isinf(limits.sigma_m):
        return math.inf
    P = c.filter.covariances[c.times.tick % m.RING]
    left_m2 = limits.sigma_m * limits.sigma_m - largest_position_variance(c)
    if left_m2 <= 0.0:
        return 0.0
    # Variance after s metres: that of the place + 2·s·(its covariance with the heading) + s²·(variance of that) + g·s
    slope_m = limits.growth_m + 2.0 * math.hypot(P[m.EAST, m.HEADING], P[m.NORTH, m.HEADING])
    root_m = math.sqrt(slope_m * slope_m + 4.0 * P[m.HEADING, m.HEADING] * left_m2)
    way_m: float = 2.0 * left_m2 / (slope_m + root_m)
    return way_m


@kernel
def must_stand(computer: Computer, limits: DeadReckoning) -> bool:
    """Return whether a robot without fixes may not drive as far as its guidance takes it; arguments as before."""
    return bool(allowed_way_m(computer, limits) < limits.way_m)


@kernel
def speed_to_rest_within(way_m: float, acceleration_mps2: float, lag_s: float) -> float:
    """Return the speed (m/s) from which a robot comes to rest within a distance, its actuators late by `lag_s`."""
    if math.isinf(way_m):
        return math.inf
    root_s = math.sqrt(lag_s * lag_s + 2.0 * way_m / acceleration_mps2)
    return acceleration_mps2 * (root_s - lag_s)
