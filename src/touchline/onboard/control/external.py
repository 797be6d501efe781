"""External follower: a controller in another program, asked in lock-step for the twist of every tick.

Sim time waits for the answer, so a controller that computes the same gives the same session however slow it is. If
there is none, pure pursuit brakes the robot and the traversal is paused.
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
"""An external follower is given the reference of the next second."""


class FollowerQuestion(NamedTuple):
    """What an external follower is given in a tick; see `Follower.step`."""

    first: bool
    """Whether a motion begins: whatever the follower has learned about the last one is void."""
    now: NDArray[np.float64]
    ahead: NDArray[np.float64]


class Interrupted(Exception):
    """The wait for an answer was broken off, because somebody waits to stop the robot."""


Ask = Callable[[FollowerQuestion], tuple[float, float]]
"""Answers with speed [m/s] and yaw rate [rad/s]; raises `ConnectionError` with the reason if there is no answer, and
`Interrupted` if it was not waited for."""


def nobody(_question: FollowerQuestion) -> tuple[float, float]:
    """Stands for an external follower where none is connected.

    Raises:
        ConnectionError: Always.
    """
    raise ConnectionError("no external follower is connected")


class ExternalFollower:
    """See the module."""

    can_fail = True

    def __init__(self, vehicle: Vehicle, ask: Ask, name: str = EXTERNAL) -> None:
        """A follower at rest that asks `ask`, by EXTERNAL_TIMED as its name one that keeps the plan's time."""
        self.name, self.timed = name, name == EXTERNAL_TIMED
        self._ask = ask
        self._pursuit = PurePursuitFollower(vehicle)
        self._first = True
        self._stopping = False
        self.ahead_rows = self.fine_rows = AHEAD_TICKS
        self.fallbacks = 0
        """Ticks that pure pursuit had to take."""
        self.problem = ""

    def reset(self) -> None:
        """The next question begins a motion."""
        self._first = True
        self._stopping = False
        self.problem = ""
        self._pursuit.reset()

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """As `Follower.step`. After a failure, or if the wait is broken off, it is not asked before the robot rests."""
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
