"""Calls of the same service of several robots at once, without waiting for any of them in turn."""

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
"""Timeout, wall clock: a robot that was never guided compiles what guiding needs."""
_LOOK_S: Final = 0.001
_SILENT: Final = "does not answer"


class GroupCall:
    """Same call to several robots, and their answers.

    Attributes:
        refused: Reason of each robot that has refused, or has not answered in time, by name.
    """

    def __init__(
        self, buses: Mapping[str, Bus], service: Service[Any, Any], request: m.Message, timeout_s: float
    ) -> None:
        """Call all robots.

        Args:
            buses: Buses of the robots, by name.
            service: Service of theirs, whose responses have `success` and `message`.
            request: The same for all.
            timeout_s: Wall-clock time for all of them together.
        """
        self._service, self._deadline_s = service, time.monotonic() + timeout_s
        payload = encode(request)
        self._open = {name: bus.ask(service, payload, timeout_s) for name, bus in buses.items()}
        self.refused: dict[str, str] = {}

    @property
    def done(self) -> bool:
        """Return whether all have answered or run out of time."""
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
        """Wait until it is done; return the robots that refused, with their reasons."""
        while not self.done:
            time.sleep(_LOOK_S)
        return self.refused

    def _problem(self, answer: Answer) -> str:
        """Return why a robot does not comply; empty if it does."""
        if answer.refusal is not None or answer.payload is None:
            return answer.refusal or _SILENT
        try:
            response = decode(self._service.response, answer.payload)
        except PayloadError as error:
            return str(error)
        return "" if response.success else response.message or "refuses"


def start_guidance(buses: Mapping[str, Bus], lockstep_s: float, *, plans: bool, margin_m: float) -> GroupCall:
    """Have robots be guided from now on.

    Args:
        buses: Buses of the robots, by name; all of one session, whose guidance they take then.
        lockstep_s: Period at which emulated robots wait for an answer; 0: they never do.
        plans: Whether by plans instead of cells.
        margin_m: Distance by which robots may be off that; 0: any.
    """
    (session,) = {bus.session_id for bus in buses.values()}
    request_id = uuid.uuid4().hex
    request = m.BeginGuidedRequest(
        request_id=request_id, coordinator=session, lockstep_s=lockstep_s, plans=plans, margin_m=margin_m
    )
    return GroupCall(buses, topics.BEGIN_GUIDED, request, GUIDED_S)


def reasons(refused: Mapping[str, str]) -> str:
    """Return the refusals and their reasons as one line."""
    return "; ".join(f"{name}: {reason}" for name, reason in sorted(refused.items()))
