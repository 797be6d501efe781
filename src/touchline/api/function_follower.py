"""A follower that is a function of the user's: no class, no registration."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.tracking_state import HEADING_ERROR, LATERAL, NOZZLE_LATERAL, REFERENCE_SPEED, SPEED, YAW_RATE
from touchline.onboard.trajectory.path_projection import A_SPEED, A_YAW_RATE

Floats = NDArray[np.float64]
#: Ticks ahead, 10 ms each, for which a function sees the reference.
AHEAD_TICKS = 100


class FollowerState(NamedTuple):
    """Tracking errors and motion of the robot, as it estimates them.

    Attributes:
        lateral_m: Distance of its origin to the left of the path.
        heading_error_rad: Its heading less that of the path.
        nozzle_lateral_m: Distance of the nozzle to the left of its own path.
        speed_mps: Its speed, negative backward.
        yaw_rate_radps: Its yaw rate, counter-clockwise.
        reference_speed_mps: Speed of the reference, negative backward.
    """

    lateral_m: float
    heading_error_rad: float
    nozzle_lateral_m: float
    speed_mps: float
    yaw_rate_radps: float
    reference_speed_mps: float


class FollowerAhead(NamedTuple):
    """Reference in the time to come.

    Attributes:
        speed_mps: (100,) its speed now, in 10 ms, and so on; negative backward.
        yaw_rate_radps: (100,) its yaw rate then.
    """

    speed_mps: Floats
    yaw_rate_radps: Floats


FollowerFunction = Callable[[FollowerState, FollowerAhead], tuple[float, float]]
"""From state and reference to the wanted speed (m/s) and yaw rate (rad/s) until the next tick."""


class FunctionFollower:
    """Adapter of a `FollowerFunction` to the interface of followers."""

    can_fail = False
    timed = False
    problem = ""
    fallbacks = 0
    ahead_rows = fine_rows = AHEAD_TICKS

    def __init__(self, function: FollowerFunction) -> None:
        """Take the function; its name is the follower's."""
        self._function = function
        self.name = getattr(function, "__name__", type(function).__name__)

    def reset(self) -> None:
        """Do nothing: a function has no memory."""

    def step(self, now: Floats, ahead: Floats) -> BodyTwist:
        """See `Follower.step`."""
        speed_mps, yaw_rate_radps = self._function(follower_state(now), follower_ahead(ahead))
        return BodyTwist(float(speed_mps), float(yaw_rate_radps))


def follower_state(now: Floats) -> FollowerState:
    """The state in `now` of `Follower.step`."""
    return FollowerState(*now[[LATERAL, HEADING_ERROR, NOZZLE_LATERAL, SPEED, YAW_RATE, REFERENCE_SPEED]].tolist())


def follower_ahead(ahead: Floats) -> FollowerAhead:
    """The reference in `ahead` of `Follower.step`."""
    return FollowerAhead(ahead[:, A_SPEED], ahead[:, A_YAW_RATE])
