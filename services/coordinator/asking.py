"""Asking robots for the same thing, all at once, without waiting for any of them in turn."""

from __future__ import annotations

import time
import uuid
from collections.abc import Mapping
from typing import Any, Final

from touchline.bus import Answer, Bus
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.topics import Service

GUIDED_S: Final = 110.0
"""Wall time: a robot that has never been guided compiles what it needs for that."""
_LOOK_S: Final = 0.001
_SILENT: Final = "does not answer"
_LATER_S: Final = 1.0
"""Zenoh gives up a question so much later than is done here, and says nothing of its own of a silent robot."""


class AskedRobots:
    """Robots that have been asked for something, and what they answer.

    Attributes:
        refused: Why those do not do it that have refused, or have not answered in time, by name.
    """

    def __init__(
        self, buses: Mapping[str, Bus], service: Service[Any, Any], request: m.Message, timeout_s: float
    ) -> None:
        """Ask all.

        Args:
            buses: Of the robots, by name.
            service: Of theirs, whose responses have `success` and `message`.
            request: The same to all.
            timeout_s: Wall time that all of them have together.
        """
        self._service, self._deadline_s = service, time.monotonic() + timeout_s
        payload = encode(request)
        zenoh_s = timeout_s + _LATER_S
        self._open = {name: bus.ask(service, payload, zenoh_s) for name, bus in buses.items()}
        self.refused: dict[str, str] = {}

    @property
    def done(self) -> bool:
        """Whether all have answered, or have had their time."""
        for name, question in list(self._open.items()):
            if (answer := question.poll()) is None:
                continue
            del self._open[name]
            if problem := self._problem(answer):
                self.refused[name] = problem
        if self._open and time.monotonic() >= self._deadline_s:
            self.refused |= dict.fromkeys(self._open, _SILENT)
            self._open = {}
        return not self._open

    def wait(self) -> dict[str, str]:
        """Wait until it is done; returns who refused, and why."""
        while not self.done:
            time.sleep(_LOOK_S)
        return self.refused

    def _problem(self, answer: Answer) -> str:
        """Why a robot does not do what it was asked for; empty if it does."""
        if answer.refusal is not None or answer.payload is None:
            return answer.refusal or _SILENT
        try:
            told = decode(self._service.response, answer.payload)
        except PayloadError as error:
            return str(error)
        return "" if told.success else told.message or "refuses"


def ask_to_be_guided(buses: Mapping[str, Bus], lockstep_s: float) -> AskedRobots:
    """Have robots be guided from now on.

    Args:
        buses: Of the robots, by name; all of one session, whose guidance they take then.
        lockstep_s: At whose multiples emulated robots wait for an answer; 0: they never do.
    """
    (session,) = {bus.session_id for bus in buses.values()}
    request = m.BeginGuidedRequest(request_id=uuid.uuid4().hex, coordinator=session, lockstep_s=lockstep_s)
    return AskedRobots(buses, topics.BEGIN_GUIDED, request, GUIDED_S)


def reasons(refused: Mapping[str, str]) -> str:
    """Who refused, and why, in a line."""
    return "; ".join(f"{name}: {reason}" for name, reason in sorted(refused.items()))
