"""Follower that steers by the path law of `frenet_law`, at the reference's speed.

The path's curvature is taken ahead by the lag of the actuators, and the wanted heading is turned into a curve by the
drift angle of the tyres.
"""

from __future__ import annotations

import numpy as np

from touchline.core.jit import kernel
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.control.frenet_law import FrenetLaw, path_yaw_rate_radps
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.control.timed.tracking_law import Floats
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.tracking_state import HEADING_ERROR, LATERAL, SPEED
from touchline.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE, CREEP_MPS
from touchline.schemas.onboard import OnboardConfig, TrackingGains
from touchline.schemas.vehicles import Vehicle


class FrenetFollower:
    """Follower by the path law of Samson and Micaelli, with feed-forward of lag and side slip."""

    name = "frenet"
    can_fail = False
    timed = False
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """Make a follower with the default gains."""
        drive = drive_of(vehicle)
        self._law = _law(TrackingGains())
        self._lead, self._side_slip = lead_ticks(drive.lag_s), drive.side_slip_rad_per_mps2
        self._twist = np.zeros(2)
        self.ahead_rows = self.fine_rows = self._lead + 1
        self.fallbacks = 0
        """Always 0: there is no simpler method to fall back on."""

    def configure(self, config: OnboardConfig) -> None:
        """See `ConfiguredFollower.configure`."""
        self._law = _law(config.tracking)

    def reset(self) -> None:
        """Do nothing: the law has no memory."""

    def step(self, now: Floats, ahead: Floats) -> BodyTwist:
        """See `Follower.step`."""
        keep_to_path(now, ahead, (self._lead, self._side_slip), self._law, self._twist)
        speed_mps, yaw_rate_radps = self._twist.tolist()
        return BodyTwist(speed_mps, yaw_rate_radps)


def _law(gains: TrackingGains) -> FrenetLaw:
    return FrenetLaw(gains.lateral_1pm2, gains.heading_1ps)


@kernel
def keep_to_path(now: Floats, ahead: Floats, robot: tuple[int, float], law: FrenetLaw, twist: Floats) -> None:
    """Compute the twist for the coming tick.

    Args:
        now: (NOW,) of `tracking_state`.
        ahead: (more than `lead`, AHEAD_COLUMNS) of `path_projection`, a tick apart.
        robot: Ticks by which the path's curvature is taken ahead, `lead`, and the slip angle of the tyres per lateral
            acceleration [rad/(m/s²)].
        law: Gains of the law.
        twist: (2,) filled with speed [m/s] and yaw rate [rad/s].
    """
    lead, side_slip = robot
    speed, turning = ahead[lead, A_SPEED], ahead[lead, A_YAW_RATE]
    crab = side_slip * now[SPEED] * ahead[0, A_YAW_RATE]
    curvature = turning / speed if abs(speed) >= CREEP_MPS else 0.0
    yaw_rate = path_yaw_rate_radps(law, now[LATERAL], now[HEADING_ERROR] - crab, curvature, speed)
    twist[0], twist[1] = speed, yaw_rate if curvature != 0.0 else yaw_rate + turning
