"""Asks an external follower over the bus, tick by tick."""

from __future__ import annotations

from typing import Final

from schemas import messages as m
from schemas import topics
from schemas.errors import PayloadError
from services.bus import Bus, CallError
from services.robot_sim.onboard.followers import Question

TIMEOUT_S: Final = 1.0
"""Wall clock. Sim time stands still meanwhile, and so do the robot's other services."""


class Lockstep:
    """`Ask` of an external follower, over the service `follower/step`."""

    def __init__(self, bus: Bus) -> None:
        """Ask on this bus."""
        self._bus = bus
        self._step = 0

    def __call__(self, question: Question) -> tuple[float, float]:
        """Wheel speeds (left, right) [rad/s].

        Raises:
            ConnectionError: Nobody answered in time, or with something else.
        """
        self._step += 1
        request = m.FollowerStepRequest(
            step=self._step,
            first=question.first,
            **dict(zip(NOW_FIELDS, question.now.tolist(), strict=True)),
            ahead_speed_mps=question.ahead[:, 0].tolist(),
            ahead_yaw_rate_radps=question.ahead[:, 1].tolist(),
        )
        try:
            answer = self._bus.call(topics.FOLLOWER_STEP, request, timeout_s=TIMEOUT_S)
        except (CallError, PayloadError) as error:
            raise ConnectionError(f"the external follower does not answer: {error}") from error
        if answer.step != self._step:
            raise ConnectionError(f"the external follower answered step {answer.step} instead of {self._step}")
        return answer.left_radps, answer.right_radps


NOW_FIELDS: Final = (
    "lateral_m",
    "heading_error_rad",
    "nozzle_lateral_m",
    "speed_mps",
    "yaw_rate_radps",
    "reference_speed_mps",
    "left_radius_m",
    "right_radius_m",
    "left_command_radps",
    "right_command_radps",
)
"""Fields of the request in the order of `tracking`'s `now`."""
