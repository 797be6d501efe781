"""Followers: from where the robot is beside its path to what its wheels should do."""

from __future__ import annotations

from schemas.vehicle import Vehicle
from services.robot_sim.onboard.followers.interface import Follower
from services.robot_sim.onboard.followers.mpc import MpcFollower
from services.robot_sim.onboard.followers.pure_pursuit import PurePursuitFollower

__all__ = ["Follower", "MpcFollower", "PurePursuitFollower", "make_follower"]


def make_follower(name: str, vehicle: Vehicle) -> Follower:
    """The follower of this name (`Scenario.follower`).

    Raises:
        ValueError: There is none.
    """
    if name == "mpc":
        return MpcFollower(vehicle)
    if name == "pure-pursuit":
        return PurePursuitFollower(vehicle)
    raise ValueError(f'there is no follower "{name}"; choose mpc or pure-pursuit')
