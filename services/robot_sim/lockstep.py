"""Lockstep with an external follower over the bus, tick by tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from touchline.bus import Bus, CallError
from touchline.onboard.control import FollowerQuestion, Interrupted
from touchline.onboard.tracking_state import ALONG, COMMAND
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError

TIMEOUT_S: Final = 1.0
"""Wall-clock timeout. Sim time stands still meanwhile, and so do all services except those that `interrupted`
checks."""


class Lockstep:
    """The `Ask` function of an external follower, over the service `follower/step`.

    Args:
        bus: Bus of the robot.
        interrupted: Returns True if a request that has to be answered at once is waiting; called every few
            milliseconds.
    """

    def __init__(self, bus: Bus, interrupted: Callable[[], bool] = lambda: False) -> None:
        self._bus = bus
        self._interrupted = interrupted
        self._step = 0

    def __call__(self, question: FollowerQuestion) -> tuple[float, float]:
        """Return the wanted twist: speed [m/s] and yaw rate [rad/s].

        Raises:
            ConnectionError: There was no valid answer in time.
            Interrupted: The wait was broken off.
        """
        self._step += 1
        request = m.FollowerStepRequest(
            step=self._step,
            first=question.first,
            **dict(zip(NOW_FIELDS, question.now.tolist(), strict=False)),
            **dict(zip(TIMED_FIELDS, question.now[ALONG:COMMAND].tolist(), strict=True)),
            ahead_speed_mps=question.ahead[:, 0].tolist(),
            ahead_yaw_rate_radps=question.ahead[:, 1].tolist(),
        )
        try:
            answer = self._bus.call(topics.FOLLOWER_STEP, request, TIMEOUT_S, self._look)
        except (CallError, PayloadError) as error:
            raise ConnectionError(f"the external follower does not answer: {error}") from error
        if answer.step != self._step:
            raise ConnectionError(f"the external follower answered step {answer.step} instead of {self._step}")
        return answer.speed_mps, answer.yaw_rate_radps

    def _look(self) -> None:
        if self._interrupted():
            raise Interrupted


NOW_FIELDS: Final = (
    "lateral_m",
    "heading_error_rad",
    "nozzle_lateral_m",
    "speed_mps",
    "yaw_rate_radps",
    "reference_speed_mps",
)
"""Fields of the request in the order of `tracking_state`; later elements are the drive's own."""
TIMED_FIELDS: Final = ("along_m", "across_m", "turn_rad", "reference_acceleration_mps2")
"""Fields from ALONG on."""
