"""Interface of followers."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, NamedTuple, Protocol, TypeAlias, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.trajectory.path import Leg
from touchline.schemas.onboard import OnboardConfig


class BodyTwist(NamedTuple):
    """Output of a follower until the next tick.

    Attributes:
        speed_mps: Forward speed of the body.
        yaw_rate_radps: Yaw rate of the body, counter-clockwise.
        actuators: Commands that lead to it, if the follower has worked them out within the drive's limits; otherwise
            the drive does.
    """

    speed_mps: float
    yaw_rate_radps: float
    actuators: tuple[float, ...] | None = None


class FollowerInput(NamedTuple):
    """Inputs of a follower, which is asked for a twist.

    Attributes:
        now: See `Follower.step`.
        ahead: See `Follower.step`.
        arguments: Arguments of the kernel with which the tick continues; None if it continues in Python.
    """

    now: NDArray[np.float64]
    ahead: NDArray[np.float64]
    arguments: tuple[Any, ...] | None = None


T = TypeVar("T")
Asking: TypeAlias = Generator[FollowerInput, BodyTwist | None, T]
"""Computation that stops where it needs a follower, and continues with the answer."""


class Follower(Protocol):
    """Controller that keeps the robot on its path; called once per tick while the robot is to move."""

    @property
    def name(self) -> str:
        """Name as in `OnboardConfig.follower`, registered in `FOLLOWERS` of schemas/plugins.py."""
        ...

    @property
    def ahead_rows(self) -> int:
        """Number of rows of `ahead`."""
        ...

    @property
    def fine_rows(self) -> int:
        """Number of rows that are a tick apart; later ones are COARSE_TICKS of `path_projection` apart."""
        ...

    @property
    def fallbacks(self) -> int:
        """Ticks in which the follower could not apply its own method and used a simpler one."""
        ...

    @property
    def can_fail(self) -> bool:
        """True if `problem` may be set in any tick: the robot is then emulated tick by tick, which is slower."""
        ...

    @property
    def timed(self) -> bool:
        """True if it keeps the plan's time: its reference moves by that time, and `now` holds the errors against it.

        A follower without this property does not.
        """
        ...

    @property
    def problem(self) -> str:
        """Reason why the robot must stop, "" if there is none; `reset` clears it."""
        ...

    def reset(self) -> None:
        """Forget everything learned about the motion: the robot stood still, or another path begins."""
        ...

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """Compute the wanted twist of the body until the next tick.

        Args:
            now: (NOW,) of `tracking_state`: errors against the path, twist, reference speed, and commands of the
                actuators.
            ahead: (ahead_rows, AHEAD_COLUMNS) of `path_projection`: reference speed and yaw rate in the time to come.
        """
        ...


def answered(asking: Asking[T], follower: Follower) -> T:
    """Run a computation to its end with the answers of a follower; return its result."""
    try:
        asked = next(asking)
        while True:
            asked = asking.send(follower.step(asked.now, asked.ahead))
    except StopIteration as end:
        result: T = end.value
        return result


def keeps_time(follower: Follower) -> bool:
    """Return True if a follower is timed."""
    return bool(getattr(follower, "timed", False))


class PathPlace(Protocol):
    """The path itself and the robot's place on it, at any time; the contents of `now` are not repeated."""

    @property
    def leg(self) -> Leg:
        """Leg that is being driven; another one after every standstill of the path."""
        ...

    @property
    def pieces(self) -> NDArray[np.float64]:
        """Pieces of the leg, (n, COLUMNS) of `smoothing`; for `pose_on` of `path_projection`."""
        ...

    @property
    def arc_length_m(self) -> float:
        """Arc length of the robot along the path."""
        ...


@runtime_checkable
class PathFollower(Protocol):
    """Follower that needs more of the path than `ahead` contains; offering this is optional."""

    def take_path(self, path: PathPlace) -> None:
        """Begin a job on this path, which is valid until another one is passed."""
        ...


@runtime_checkable
class ConfiguredFollower(Protocol):
    """Follower with settings of its own in the computer's configuration; offering this is optional."""

    def configure(self, config: OnboardConfig) -> None:
        """Apply the settings; called when the computer is built."""
        ...
