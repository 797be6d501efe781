"""Look for another coordinator that has taken over: robots refuse this one then, and it ends."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import Final

from touchline.bus import Bus
from touchline.bus.calls import Question
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError, TouchlineError

_LOOK_S: Final = 0.5
_ANSWER_S: Final = 1.0


class Replaced(TouchlineError):
    """Error: another coordinator has taken over, and robots refuse this one."""


class Succession:
    """Look for a successor; call `look` in a loop."""

    def __init__(self, bus: Bus, buses: Mapping[str, Bus]) -> None:
        """Look on a team's bus.

        Args:
            bus: Bus of the team's namespace.
            buses: Buses of the robots, by name.
        """
        self._bus, self._buses = bus, buses
        self._look_s = 0.0
        self._asked: dict[str, Question] = {}

    def look(self, now_s: float) -> None:
        """Ask the robots whom they obey, if there is another coordinator on the bus.

        Raises:
            Replaced: One obeys another.
        """
        for name, question in list(self._asked.items()):
            if (answer := question.poll()) is not None:
                del self._asked[name]
                self._look_at(name, answer.payload)
        if self._asked or now_s < self._look_s:
            return
        self._look_s = now_s + _LOOK_S
        ours = self._bus.session_id
        if self._bus.sessions(topics.COORDINATOR) - {ours}:
            request = encode(m.SetOwnerRequest(request_id=uuid.uuid4().hex, coordinator=ours))
            self._asked = {name: bus.ask(topics.SET_OWNER, request, _ANSWER_S) for name, bus in self._buses.items()}

    def _look_at(self, name: str, payload: bytes | None) -> None:
        """Look at a robot's answer.

        Raises:
            Replaced: It obeys another coordinator.
        """
        try:
            response = decode(m.SetOwnerResponse, payload) if payload is not None else m.SetOwnerResponse()
        except PayloadError:
            return
        if response.coordinator and response.coordinator != self._bus.session_id:
            remedy = "this one guides nobody any more; start it with --standby"
            raise Replaced(f"another coordinator has taken over: {name} says that {response.message}; {remedy}")
