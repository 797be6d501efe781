"""Follower that steers by a tracking law.

A law does not model actuators. So the reference's motion is taken ahead by their lag, and the wanted heading is turned
into a curve by the drift angle of the tyres.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from touchline.core.jit import kernel
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.control.timed.tracking_law import LAW_MEMORY, Floats, TrackingErrors, Wanted, steer
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.tracking_state import ACROSS, ALONG, REFERENCE_ACCELERATION, SPEED, TURN
from touchline.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE
from touchline.schemas.onboard import OnboardConfig, TrackingGains
from touchline.schemas.vehicles import Vehicle

LawOf = Callable[[TrackingGains], Any]
"""Function that makes a law with these gains, for `tracking_law.steer`."""


class TrajectoryTracker:
    """Timed follower by one of the tracking laws."""

    can_fail = False
    timed = True
    problem = ""

    def __init__(self, name: str, law_of: LawOf, vehicle: Vehicle) -> None:
        """Make a follower at rest, with the default gains.

        Args:
            name: Name of the follower.
            law_of: Function that makes its law.
            vehicle: The nominal robot.
        """
        drive = drive_of(vehicle)
        self.name = name
        self._law_of, self._law = law_of, law_of(TrackingGains())
        self._lead, self._side_slip = lead_ticks(drive.lag_s), drive.side_slip_rad_per_mps2
        self._memory, self._twist = np.zeros(LAW_MEMORY), np.zeros(2)
        self._code: Callable[..., None] | None = None  # `track_by_law` for the types of its arguments
        self.ahead_rows = self.fine_rows = self._lead + 1
        self.fallbacks = 0
        """Always 0: there is no simpler method to fall back on."""

    def configure(self, config: OnboardConfig) -> None:
        """See `ConfiguredFollower.configure`."""
        self._law = self._law_of(config.tracking)

    def reset(self) -> None:
        """Clear the memory of the law."""
        self._memory[:] = 0.0

    def step(self, now: Floats, ahead: Floats) -> BodyTwist:
        """See `Follower.step`."""
        arguments = (now, ahead, (self._lead, self._side_slip), self._law, self._memory, self._twist)
        if self._code is None:
            self._code = track_by_law.for_types_of(arguments)
        self._code(*arguments)
        speed_mps, yaw_rate_radps = self._twist.tolist()
        return BodyTwist(speed_mps, yaw_rate_radps)


@kernel
def track_by_law(now: Floats, ahead: Floats, robot: tuple[int, float], law: Any, memory: Floats, twist: Floats) -> None:
    """Compute the twist for the coming tick.

    Args:
        now: (NOW,) of `tracking_state`, of a timed reference.
        ahead: (more than `lead`, AHEAD_COLUMNS) of `path_projection`, a tick apart.
        robot: Ticks by which the reference's motion is taken ahead, `lead`, and the slip angle of the tyres per lateral
            acceleration [rad/(m/s²)].
        law: Law for `tracking_law.steer`.
        memory: (LAW_MEMORY,) memory of the law, updated.
        twist: (2,) filled with speed [m/s] and yaw rate [rad/s].
    """
    lead, side_slip = robot
    crab = side_slip * now[SPEED] * ahead[0, A_YAW_RATE]
    errors = TrackingErrors(now[ALONG], now[ACROSS], now[TURN] + crab)
    wanted = Wanted(ahead[lead, A_SPEED], ahead[lead, A_YAW_RATE], now[REFERENCE_ACCELERATION])
    twist[0], twist[1] = steer(law, errors, wanted, memory)
