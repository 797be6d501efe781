"""Followers: from where the robot is beside its path to what its wheels should do."""

from __future__ import annotations

from touchline.schemas.vehicle import Vehicle
from touchline.services.onboard.control.external import Ask, ExternalFollower, Interrupted, Question, nobody
from touchline.services.onboard.control.follower import Follower
from touchline.services.onboard.control.mpc import MpcFollower
from touchline.services.onboard.control.pure_pursuit import PurePursuitFollower

__all__ = [
    "Ask",
    "Follower",
    "Interrupted",
    "MpcFollower",
    "PurePursuitFollower",
    "Question",
    "make_follower",
    "nobody",
]


def make_follower(name: str, vehicle: Vehicle, ask: Ask = nobody) -> Follower:
    """The follower of this name (`OnboardConfig.follower`); an external one is asked by `ask`.

    Raises:
        ValueError: There is none.
    """
    if name == "mpc":
        return MpcFollower(vehicle)
    if name == "pure-pursuit":
        return PurePursuitFollower(vehicle)
    if name == "external":
        return ExternalFollower(vehicle, ask)
    raise ValueError(f'there is no follower "{name}"; choose mpc, pure-pursuit or external')
