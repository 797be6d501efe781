"""The interface of followers."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.trajectory.path import Leg
from touchline.schemas.onboard import OnboardConfig


class BodyTwist(NamedTuple):
    """What a follower wants until the next tick.

    Attributes:
        speed_mps: Of the body, forward.
        yaw_rate_radps: Of the body, counter-clockwise.
        actuators: The commands that lead to it, if the follower has worked them out within the drive's limits; else the
            drive does.
    """

    speed_mps: float
    yaw_rate_radps: float
    actuators: tuple[float, ...] | None = None


class Follower(Protocol):
    """Keeps the robot on its path. Called once per tick while the robot is to move."""

    @property
    def name(self) -> str:
        """As in `OnboardConfig.follower`, and registered in `FOLLOWERS` of schemas/plugins.py."""
        ...

    @property
    def ahead_rows(self) -> int:
        """Rows of `ahead`: how far it looks."""
        ...

    @property
    def fine_rows(self) -> int:
        """How many of these are a tick apart; those after them are COARSE_TICKS of `path_projection` apart."""
        ...

    @property
    def fallbacks(self) -> int:
        """Ticks in which the follower could not do its own method and used a simpler one."""
        ...

    @property
    def can_fail(self) -> bool:
        """Whether `problem` may be set in any tick: the robot is then emulated tick by tick, which is slower."""
        ...

    @property
    def timed(self) -> bool:
        """Whether it keeps the plan's time: its reference then moves by that, and `now` tells how far it is off.

        One that does not offer this does not.
        """
        ...

    @property
    def problem(self) -> str:
        """Why the robot must stop, "" if it need not; a `reset` clears it."""
        ...

    def reset(self) -> None:
        """Forget what was learned about the motion: the robot stood still, or another path begins."""
        ...

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """The wanted twist of the body until the next tick.

        Args:
            now: (NOW,) of `tracking_state`: errors against the path, twist, reference speed, and what the actuators do.
            ahead: (ahead_rows, AHEAD_COLUMNS) of `path_projection`: reference speed and yaw rate in the time to come.
        """
        ...


def keeps_time(follower: Follower) -> bool:
    """Whether it is a timed one."""
    return bool(getattr(follower, "timed", False))


class PathPlace(Protocol):
    """The path itself and where on it the robot is, at any time; what is told by `now` is not repeated."""

    @property
    def leg(self) -> Leg:
        """What is driven without stopping; another one after every standstill of the path."""
        ...

    @property
    def pieces(self) -> NDArray[np.float64]:
        """(n, COLUMNS) pieces of the leg, of `smoothing`; for `pose_on` of `path_projection`."""
        ...

    @property
    def arc_length_m(self) -> float:
        """Where the robot is, along the path."""
        ...


@runtime_checkable
class PathFollower(Protocol):
    """A follower that needs more of the path than `ahead` tells. Offering this is optional."""

    def take_path(self, path: PathPlace) -> None:
        """A job begins: this is its path until another one is handed over."""
        ...


@runtime_checkable
class ConfiguredFollower(Protocol):
    """A follower with settings of its own in the computer's configuration. Offering this is optional."""

    def configure(self, config: OnboardConfig) -> None:
        """The computer is built."""
        ...
