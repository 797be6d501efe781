"""Exclusive ownership of a node name on the bus, since two processes would answer the same requests."""

import logging
import time
from collections.abc import Callable, Iterator
from typing import Final, Protocol

import zenoh
from zenoh import handlers

from touchline.bus.calls import Server
from touchline.bus.config import BusConfig
from touchline.bus.presence import all_tokens, parse_token, token_prefix
from touchline.bus.publisher import Publisher
from touchline.schemas import topics
from touchline.schemas.bus_variables import ENDPOINT_VARIABLE, NAMESPACE_VARIABLE
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages import (
    DiagnosticArray,
    DiagnosticStatus,
    Event,
    GetDiagnosticsRequest,
    GetDiagnosticsResponse,
    Header,
    Time,
)
from touchline.schemas.topics import Request, Response, Service, Topic

_LOG: Final = logging.getLogger(__name__)
#: Time in which a newcomer learns of all of its peers, from the first one.
_GETTING_TO_KNOW_S: Final = 0.3
#: Time in which a leaving process is gone.
_LEAVING_S: Final = 0.5
#: Time in which a serving process answers.
_ANSWER_S: Final = 1.0
_REPLIES: Final = 1024
_POLL_S: Final = 0.005
#: Answer of a process that has yet to find out whether its name is free.
_CLAIMING: Final = "starting: claiming its name"


class Claimant(Protocol):
    """Part of a `Bus` that claims its node's name."""

    node: str
    config: BusConfig

    def asked_key(self, service: Service[Request, Response]) -> str:
        """Return the key by which this process asks for a service."""

    def publisher(self, topic: Topic) -> Publisher:
        """Declare a publisher of a topic."""

    def serve(self, service: Service[Request, Response]) -> Server[Request, Response]:
        """Declare a server of a service."""


def claim(bus: Claimant, session: zenoh.Session, opened_at_s: float) -> None:
    """Make sure that no other process of this name serves; use :meth:`touchline.bus.Bus.claim`.

    A token proves nothing, anybody can declare one: a namesake counts if it answers for itself. Of two that claim their
    name at the same time, the one with the lesser id gets it.
    """
    server = bus.serve(topics.diagnostics_service(bus.node))  # for another that claims this name now

    def answer() -> None:
        while (call := server.poll()) is not None:
            call.reply(_claiming(bus.node))

    time.sleep(max(0.0, opened_at_s + _GETTING_TO_KNOW_S - time.monotonic()))
    begun = time.monotonic()
    while namesakes := _namesakes(bus, session):
        waited_s = time.monotonic() - begun
        if waited_s >= _LEAVING_S and _somebody_serves(bus, session, namesakes, answer):
            raise TouchlineError(
                f'{bus.node} is already running for robot "{bus.config.namespace}" on {bus.config.endpoint}; '
                f"stop it first, or choose another {NAMESPACE_VARIABLE} or {ENDPOINT_VARIABLE}"
            )
        if waited_s >= _LEAVING_S + _ANSWER_S:
            _warn(bus, namesakes)
            return
        answer()
        time.sleep(0.02)


def _namesakes(bus: Claimant, session: zenoh.Session) -> set[str]:
    """Return the ids of other sessions of this name."""
    namespace = bus.config.namespace
    replies = session.liveliness().get(
        all_tokens(namespace, bus.node), handlers.FifoChannel(_REPLIES), timeout=_ANSWER_S
    )
    found: set[str] = set()
    for reply in _until_closed(replies):
        token = parse_token(str(reply.ok.key_expr), token_prefix(namespace)) if reply.ok is not None else None
        if token is not None:
            found.add(token.instance)
    return found - {str(session.zid())}


def _somebody_serves(
    bus: Claimant, session: zenoh.Session, namesakes: set[str], while_waiting: Callable[[], None]
) -> bool:
    """Return whether one of the namesakes answers a health request by its own session."""
    service = topics.diagnostics_service(bus.node)
    replies = session.get(
        bus.asked_key(service),
        handlers.FifoChannel(_REPLIES),
        payload=encode(GetDiagnosticsRequest()),
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=_ANSWER_S,
    )
    ours = str(session.zid())
    for reply in _until_closed(replies, while_waiting):
        replier = str(reply.replier_id.zid) if reply.replier_id is not None else ""
        if reply.ok is None or replier not in namesakes:
            continue
        try:
            response = decode(service.response, reply.ok.payload.to_bytes())
        except PayloadError:
            continue
        claiming = any(status.message == _CLAIMING for status in response.diagnostics.status)
        if not claiming or replier < ours:
            return True
    return False


def _until_closed(
    replies: "handlers.Handler[zenoh.Reply]", meanwhile: Callable[[], None] = lambda: None
) -> Iterator[zenoh.Reply]:
    """Yield every reply, until all have come or timed out; taken at once, so that Zenoh's threads need not wait."""
    while True:
        meanwhile()
        try:
            reply = replies.try_recv()
        except zenoh.ZError:  # closed
            return
        if reply is None:
            time.sleep(_POLL_S)
        else:
            yield reply


def _claiming(node: str) -> GetDiagnosticsResponse:
    status = DiagnosticStatus(level=DiagnosticStatus.WARN, name=node, message=_CLAIMING)
    return GetDiagnosticsResponse(diagnostics=DiagnosticArray(status=(status,)))


def _warn(bus: Claimant, namesakes: set[str]) -> None:
    """Report namesakes that do not serve, in the log and on the bus."""
    ids = ", ".join(sorted(namesakes)[:3]) + (" …" if len(namesakes) > 3 else "")
    text = (
        f"{len(namesakes)} other session{'s' * (len(namesakes) > 1)} ({ids}) on the bus "
        f"called {bus.node} did not answer within {_ANSWER_S:.0f} s; {bus.node} starts all the same"
    )
    _LOG.warning("%s", text)
    bus.publisher(topics.SUPERVISOR_EVENTS).send(
        Event(
            header=Header(stamp=Time.of_ns(time.time_ns())),
            severity=Event.WARN,
            source=bus.node,
            code="namesake",
            text=text,
        )
    )
