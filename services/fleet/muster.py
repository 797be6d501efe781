"""Asking robots to be guided, all at once, without waiting for any of them."""

from __future__ import annotations

import uuid
from collections.abc import Mapping

from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.services.bus import Bus

TIMEOUT_S = 60.0
"""A robot that has never been guided compiles what it needs for that."""


class Muster:
    """Robots that are asked to be guided from now on.

    Attributes:
        refused: What those say that are not, by name.
    """

    def __init__(self, buses: Mapping[str, Bus], lockstep_s: float) -> None:
        """Ask all.

        Args:
            buses: Of the robots, by name.
            lockstep_s: At whose multiples emulated robots wait for an answer; 0: they never do.
        """
        request = encode(m.BeginGuidedRequest(request_id=uuid.uuid4().hex, lockstep_s=lockstep_s))
        self._asked = {name: bus.ask(topics.BEGIN_GUIDED, request, TIMEOUT_S) for name, bus in buses.items()}
        self.refused: dict[str, str] = {}

    @property
    def done(self) -> bool:
        """Whether all have answered, or have had their time."""
        for name, question in list(self._asked.items()):
            if (answer := question.poll()) is None:
                continue
            del self._asked[name]
            if answer.refusal is not None or answer.payload is None:
                self.refused[name] = answer.refusal or "does not answer"
                continue
            try:
                told = decode(m.BeginGuidedResponse, answer.payload)
            except PayloadError as error:
                self.refused[name] = str(error)
                continue
            if not told.success:
                self.refused[name] = told.message
        return not self._asked

    def __str__(self) -> str:
        """What those say that are not guided."""
        return "; ".join(f"{name} is not guided: {reason}" for name, reason in self.refused.items())
