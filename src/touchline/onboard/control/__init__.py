"""Followers: controllers that turn the tracking errors into a wanted twist."""

from __future__ import annotations

from collections.abc import Callable

from touchline.onboard.control.external import Ask, ExternalFollower, FollowerQuestion, Interrupted, nobody
from touchline.onboard.control.follower import (
    ConfiguredFollower,
    Follower,
    PathFollower,
    PathPlace,
    keeps_time,
)
from touchline.onboard.control.frenet import FrenetFollower
from touchline.onboard.control.mpc import MpcFollower
from touchline.onboard.control.pure_pursuit import PurePursuitFollower
from touchline.onboard.control.pursuit_lanes import LanePursuitFollower
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import EXTERNAL_TIMED, FOLLOWERS
from touchline.schemas.vehicles import Vehicle

__all__ = [
    "Ask",
    "ConfiguredFollower",
    "ExternalFollower",
    "Follower",
    "FollowerQuestion",
    "FrenetFollower",
    "Interrupted",
    "LanePursuitFollower",
    "Make",
    "MpcFollower",
    "PathFollower",
    "PathPlace",
    "PurePursuitFollower",
    "keeps_time",
    "make_external_timed",
    "make_follower",
    "make_frenet",
    "make_mpc",
    "make_pure_pursuit",
    "make_pursuit_lanes",
    "nobody",
]


Make = Callable[[Vehicle, Ask], Follower]
"""Function that makes a follower for a vehicle; an external one uses the second argument for its calls."""


def make_mpc(vehicle: Vehicle, _ask: Ask) -> Follower:
    """Make an `MpcFollower`; see `Make`."""
    return MpcFollower(vehicle)


def make_pure_pursuit(vehicle: Vehicle, _ask: Ask) -> Follower:
    """Make a `PurePursuitFollower`; see `Make`."""
    return PurePursuitFollower(vehicle)


def make_external_timed(vehicle: Vehicle, ask: Ask) -> Follower:
    """Make an `ExternalFollower` that keeps the plan's time; see `Make`."""
    return ExternalFollower(vehicle, ask, EXTERNAL_TIMED)


def make_frenet(vehicle: Vehicle, _ask: Ask) -> Follower:
    """Make a `FrenetFollower`; see `Make`."""
    return FrenetFollower(vehicle)


def make_pursuit_lanes(vehicle: Vehicle, _ask: Ask) -> Follower:
    """Make a `LanePursuitFollower`; see `Make`."""
    return LanePursuitFollower(vehicle)


def make_follower(name: str, vehicle: Vehicle, ask: Ask = nobody, config: OnboardConfig | None = None) -> Follower:
    """Make the follower of a name.

    Args:
        name: Registered name, as in `OnboardConfig.follower`.
        vehicle: The nominal robot.
        ask: Function that calls an external follower.
        config: Settings of followers that have any; None: the defaults.

    Raises:
        UnknownPlugin: No follower has this name.
    """
    make: Make = FOLLOWERS.find(name)
    follower = make(vehicle, ask)
    if config is not None and isinstance(follower, ConfiguredFollower):
        follower.configure(config)
    return follower
