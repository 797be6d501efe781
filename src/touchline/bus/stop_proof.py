"""Proof of a stop by the robot's own status, since the answer to an order may be a stranger's in its name.

Each process with the robot's name is asked, and each status is heard, so that another one cannot speak for a robot that
hangs. At its own door the robot alone answers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from touchline.bus.bus import Bus
from touchline.bus.calls import CallError, Question
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.topics import Request, Response, Service
from touchline.schemas.traversal_state import traversal_state

_POLL_S: Final = 0.002
_KNOWN_S: Final = 0.2
"""Time in which a newcomer on the bus learns of the other processes."""
_S: Final = m.TraversalStatus
_STOPPED: Final[Mapping[str, frozenset[int]]] = {
    topics.ESTOP.name: frozenset((_S.ESTOPPED,)),
    topics.PAUSE.name: frozenset((_S.IDLE, _S.READY, _S.PAUSED, _S.DONE, _S.ABORTED, _S.ESTOPPED)),
    topics.ABORT.name: frozenset((_S.IDLE, _S.DONE, _S.ABORTED, _S.ESTOPPED)),
}
"""By order, the states of a robot that has carried it out."""


class StopProof:
    """Calls a robot's services, and checks that it has stopped as ordered.

    Args:
        bus: Bus of the robot.
        at_door: Whether this is at the robot's own door.
    """

    def __init__(self, bus: Bus, *, at_door: bool = False) -> None:
        self._bus, self._at_door = bus, at_door
        self._inbox = None if at_door else bus.inbox([topics.STATUS], keep="recent")
        self._reported_last: dict[bytes, int] = {}

    def call(
        self,
        service: Service[Request, Response],
        request: Request,
        timeout_s: float,
        while_waiting: Callable[[], None] | None = None,
    ) -> Response:
        """Call a service; where that stops the robot, its state has to prove the answer.

        Args:
            service: Row of the topic table.
            request: The request.
            timeout_s: Time for the answer, and again for the proof.
            while_waiting: As for `Bus.call`.

        Raises:
            CallError: There is no answer, or the robot does not report that it has stopped.
            PayloadError: The answer is not a response of this service.
        """
        answer = self._bus.call(service, request, timeout_s, while_waiting)
        refused = not getattr(answer, "success", True)
        if service.name not in _STOPPED or (refused and self._may_refuse(service.name)):
            return answer
        if problem := self.lacking(service.name, timeout_s):
            raise CallError(problem)
        return answer

    def _may_refuse(self, service: str) -> bool:
        """Return whether a refusal is believed: no robot refuses an emergency stop, and of two one is a stranger."""
        robots = len(self._bus.sessions(topics.ROBOT_SIM))
        replayed = robots == 0 and bool(self._bus.sessions(topics.REPLAY))
        return replayed or (robots < 2 and service != topics.ESTOP.name)

    def lacking(self, service: str, timeout_s: float) -> str:
        """Return why it is not certain that the robot has stopped; "" if it is.

        Args:
            service: Name of the service of a stop.
            timeout_s: Time to wait for the robot's status.
        """
        node, bus, until_s = topics.ROBOT_SIM, self._bus, time.monotonic() + timeout_s
        if not self._at_door:  # a newcomer learns of the others one by one
            time.sleep(min(max(bus.opened_s + _KNOWN_S - time.monotonic(), 0.0), timeout_s))
        sessions = bus.peers() if self._at_door else bus.sessions(node)
        request = encode(m.GetDiagnosticsRequest())
        asked = {each: bus.ask_session(each, topics.diagnostics_service(node), request, timeout_s) for each in sessions}
        found = list(_states(asked, until_s))
        stopped = _STOPPED[service]
        if (
            sessions
            and len(found) == len(sessions)
            and stopped.issuperset(found)
            and self._reported_by_all(stopped, until_s)
        ):
            return ""
        claimed = f", one of {len(sessions)} processes of that name," if len(sessions) > 1 else ""
        return f"answered, but {node}{claimed} does not report itself that it has stopped"

    def _reported_by_all(self, stopped: frozenset[int], until_s: float) -> bool:
        """Return whether every status of the robot, in time, is that of a stopped one."""
        if self._inbox is None:
            return True
        while True:
            self._reported_last |= {sample.publisher: traversal_state(sample.payload) for sample in self._inbox.drain()}
            heard = self._reported_last or not self._bus.sessions(topics.TELEMETRY)
            if heard and stopped.issuperset(self._reported_last.values()):
                return True
            if time.monotonic() > until_s:
                return False
            time.sleep(_POLL_S)


def _states(asked: Mapping[str, Question], deadline_s: float) -> Iterable[int]:
    """Yield the states that come in time."""
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
        statuses = decode(m.GetDiagnosticsResponse, payload).diagnostics.status
    except PayloadError:
        return None
    values = {
        value.key: value.value for status in statuses if status.name == topics.ROBOT_SIM for value in status.values
    }
    text = values.get("state", "")
    return int(text) if text.isascii() and text.isdigit() and len(text) == 1 else None
