"""Proof of a stop: what the robot says itself, for the answer to an order may be that of a stranger in its name.

Each process that has the robot's name is asked, and each that tells its status is heard, so that a robot that is frozen
is not spoken for by another. At its own door the robot alone answers.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Final

from touchline.bus.bus import Bus
from touchline.bus.calls import Question
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.traversal_state import traversal_state

_POLL_S: Final = 0.002
_KNOWN_S: Final = 0.2
"""Whoever has joined the bus knows who else is there after this long."""
_S: Final = m.TraversalStatus
_STOPPED: Final[Mapping[str, frozenset[int]]] = {
    topics.ESTOP.name: frozenset((_S.ESTOPPED,)),
    topics.PAUSE.name: frozenset((_S.IDLE, _S.READY, _S.PAUSED, _S.DONE, _S.ABORTED, _S.ESTOPPED)),
    topics.ABORT.name: frozenset((_S.IDLE, _S.DONE, _S.ABORTED, _S.ESTOPPED)),
}
"""By order, the states of a robot that has carried it out."""


def proves(service: str) -> bool:
    """Whether the robot's state tells that an order was carried out.

    Args:
        service: Name of the order's service.
    """
    return service in _STOPPED


class StopProof:
    """Finds out whether a robot has stopped as it was ordered to.

    Args:
        bus: Of the robot.
        at_door: Whether this is at the robot's own door.
    """

    def __init__(self, bus: Bus, *, at_door: bool = False) -> None:
        self._bus, self._at_door = bus, at_door
        self._inbox = None if at_door else bus.inbox([topics.STATUS], keep="recent")
        self._told: dict[bytes, int] = {}

    def lacking(self, service: str, timeout_s: float) -> str:
        """Why it is not certain that the robot has stopped; "" if it is.

        Args:
            service: Name of the order's service, one that `proves`.
            timeout_s: For how long to wait for what the robot says.
        """
        node, bus, until_s = topics.ROBOT_SIM, self._bus, time.monotonic() + timeout_s
        if not self._at_door:  # whoever has just joined learns of the others one by one
            time.sleep(min(max(bus.opened_s + _KNOWN_S - time.monotonic(), 0.0), timeout_s))
        sessions = bus.peers() if self._at_door else bus.sessions(node)
        request = encode(m.GetDiagnosticsRequest())
        asked = {each: bus.ask_session(each, topics.diagnostics_service(node), request, timeout_s) for each in sessions}
        said = list(_states(asked, until_s))
        stopped = _STOPPED[service]
        if sessions and len(said) == len(sessions) and stopped.issuperset(said) and self._told_by_all(stopped, until_s):
            return ""
        claimed = f", one of {len(sessions)} processes of that name," if len(sessions) > 1 else ""
        return f"answered, but {node}{claimed} does not say itself that it has stopped"

    def _told_by_all(self, stopped: frozenset[int], until_s: float) -> bool:
        """Whether each status that is told of the robot is, in time, that of one that has stopped."""
        if self._inbox is None:
            return True
        while True:
            self._told |= {sample.publisher: traversal_state(sample.payload) for sample in self._inbox.drain()}
            heard = self._told or not self._bus.sessions(topics.TELEMETRY)
            if heard and stopped.issuperset(self._told.values()):
                return True
            if time.monotonic() > until_s:
                return False
            time.sleep(_POLL_S)


def _states(asked: Mapping[str, Question], deadline_s: float) -> Iterable[int]:
    """The states that come in time."""
    waiting = list(asked.values())
    while waiting and time.monotonic() < deadline_s:
        for question in list(waiting):
            if (answer := question.poll()) is not None:
                waiting.remove(question)
                if (state := _state(answer.payload)) is not None:
                    yield state
        time.sleep(_POLL_S)


def _state(payload: bytes | None) -> int | None:
    if payload is None:
        return None
    try:
        said = decode(m.GetDiagnosticsResponse, payload).diagnostics.status
    except PayloadError:
        return None
    values = {value.key: value.value for status in said if status.name == topics.ROBOT_SIM for value in status.values}
    text = values.get("state", "")
    return int(text) if text.isascii() and text.isdigit() and len(text) == 1 else None
