"""External follower: a controller in another program, called in lock-step for the twist of every tick.

Sim time waits for the answer, so a controller that computes the same gives the same session however slow it is. If
there is no answer, pure pursuit brakes the robot and the traversal is paused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.control.pure_pursuit import PurePursuitFollower
from touchline.schemas.plugins import EXTERNAL, EXTERNAL_TIMED
from touchline.schemas.vehicles import Vehicle

AHEAD_TICKS: Final = 100
"""Rows of the path ahead that an external follower receives: the next second."""


class FollowerQuestion(NamedTuple):
    """Input of an external follower in a tick; see `Follower.step`."""

    first: bool
    """True if a motion begins: anything the follower has learned about the last one is void."""
    now: NDArray[np.float64]
    ahead: NDArray[np.float64]


class Interrupted(Exception):
    """The wait for an answer was broken off, because somebody waits to stop the robot."""


Ask = Callable[[FollowerQuestion], tuple[float, float]]
"""Function that returns speed [m/s] and yaw rate [rad/s]; raises `ConnectionError` with the reason if there is no
answer, and `Interrupted` if the wait was broken off."""


def nobody(_question: FollowerQuestion) -> tuple[float, float]:
    """Stand in for an external follower where none is connected."""
    raise ConnectionError("no external follower is connected")


class ExternalFollower:
    """Follower that calls a controller in another program, with pure pursuit as the fallback."""

    can_fail = True

    def __init__(self, vehicle: Vehicle, ask: Ask, name: str = EXTERNAL) -> None:
        """Make a follower at rest.

        Args:
            vehicle: The nominal robot, for the fallback.
            ask: Function that calls the controller.
            name: EXTERNAL, or EXTERNAL_TIMED for one that keeps the plan's time.
        """
        self.name, self.timed = name, name == EXTERNAL_TIMED
        self._ask = ask
        self._pursuit = PurePursuitFollower(vehicle)
        self._first = True
        self._stopping = False
        self.ahead_rows = self.fine_rows = AHEAD_TICKS
        self.fallbacks = 0
        """Ticks in which pure pursuit stood in."""
        self.problem = ""

    def reset(self) -> None:
        """Begin a new motion with the next question."""
        self._first = True
        self._stopping = False
        self.problem = ""
        self._pursuit.reset()

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """See `Follower.step`; after a failure or interruption the controller is not called before the robot rests."""
        if not self.problem and not self._stopping:
            try:
                speed_mps, yaw_rate_radps = self._ask(FollowerQuestion(self._first, now, ahead))
            except ConnectionError as error:
                self.problem = str(error)
            except Interrupted:
                self._stopping = True
            else:
                self._first = False
                return BodyTwist(speed_mps, yaw_rate_radps)
        self.fallbacks += 1
        return self._pursuit.step(now, ahead[: self._pursuit.fine_rows])
