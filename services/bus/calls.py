"""Acknowledged commands: typed queries that are always answered."""

import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic

import zenoh
from zenoh import handlers

from schemas.cdr import decode, encode
from schemas.errors import PayloadError, TouchlineError
from schemas.topics import Request, Response, Service
from services.bus.counters import Counters

_WAITING_CALLS = 64
_REMEMBERED_ANSWERS = 16
_FIRST_POLL_S = 0.00005
_POLL_GROWTH = 1.1
_POLL_S = 0.002
_RETRY_S = 0.05
#: How long a call looks for its service before it says that nobody answers.
_DISCOVERY_S = 1.5


class CallError(TouchlineError):
    """A call that was not answered, or answered with an error; the text is the reason."""


class ServedCall(Generic[Request, Response]):
    """One request, and the place to answer it."""

    def __init__(
        self, server: "Server[Request, Response]", query: zenoh.Query, request: Request, request_id: str
    ) -> None:
        """Made by :class:`Server`."""
        self._server = server
        self.request = request
        self.request_id = request_id
        self.queries = [query]

    def reply(self, response: Response) -> None:
        """Answer; repeats of the same request id get this answer too."""
        self._server.finish(self, encode(response))

    def fail(self, reason: str) -> None:
        """Answer with an error, for what goes wrong outside the request's own meaning."""
        self._server.abandon(self, reason)


class Server(Generic[Request, Response]):
    """The serving end of one service.

    Requests that are not what they should be are answered with an error and counted; a request id that was answered
    already gets the same answer again and does nothing.
    """

    def __init__(
        self, session: zenoh.Session, key: str, service: Service[Request, Response], counters: Counters
    ) -> None:
        """Declare the queryable; use :meth:`services.bus.Bus.serve`."""
        self.service = service
        self._key = key
        self._counters = counters
        self._answers: OrderedDict[str, bytes] = OrderedDict()
        self._open: dict[str, ServedCall[Request, Response]] = {}
        self._queryable = session.declare_queryable(key, handlers.FifoChannel(_WAITING_CALLS), complete=True)

    def poll(self) -> ServedCall[Request, Response] | None:
        """The next request, if one waits."""
        while (query := self._queryable.try_recv()) is not None:
            call = self._admit(query)
            if call is not None:
                return call
        return None

    def wait(self, timeout_s: float) -> ServedCall[Request, Response] | None:
        """As :meth:`poll`, but waits up to ``timeout_s`` for a request."""
        deadline = time.monotonic() + timeout_s
        pauses = _pauses_s()
        while (call := self.poll()) is None and time.monotonic() < deadline:
            time.sleep(next(pauses))
        return call

    def _admit(self, query: zenoh.Query) -> ServedCall[Request, Response] | None:
        payload = query.payload.to_bytes() if query.payload is not None else b""
        try:
            request = decode(self.service.request, payload)
        except PayloadError as error:
            self._counters.reject(f"{self.service.name}: {error}")
            _refuse(query, str(error))
            return None
        self._counters.received += 1
        request_id = str(getattr(request, "request_id", ""))
        if request_id in self._answers:
            self._answer(query, self._answers[request_id])
            return None
        if request_id in self._open:
            self._open[request_id].queries.append(query)
            return None
        call = ServedCall(self, query, request, request_id)
        if request_id:
            self._open[request_id] = call
        return call

    def finish(self, call: ServedCall[Request, Response], payload: bytes) -> None:
        """Send ``payload`` to whoever asked with this call's id, and remember it."""
        if call.request_id:
            self._open.pop(call.request_id, None)
            self._answers[call.request_id] = payload
            while len(self._answers) > _REMEMBERED_ANSWERS:
                self._answers.popitem(last=False)
        for query in call.queries:
            self._answer(query, payload)

    def abandon(self, call: ServedCall[Request, Response], reason: str) -> None:
        """Send an error to whoever asked with this call's id; the same id may be tried again."""
        self._open.pop(call.request_id, None)
        for query in call.queries:
            _refuse(query, reason)

    def _answer(self, query: zenoh.Query, payload: bytes) -> None:
        with query:
            query.reply(self._key, payload, encoding=zenoh.Encoding("application/cdr"))
        self._counters.published += 1


def _pauses_s() -> Iterator[float]:
    """Between two looks for an answer or a request: short at first, since most come at once, then longer."""
    pause_s = _FIRST_POLL_S
    while True:
        yield pause_s
        pause_s = min(_POLL_GROWTH * pause_s, _POLL_S)


def _refuse(query: zenoh.Query, reason: str) -> None:
    with query:
        query.reply_err(reason.encode(), encoding=zenoh.Encoding.TEXT_PLAIN)


def call(
    session: zenoh.Session,
    key: str,
    service: Service[Request, Response],
    request: Request,
    timeout_s: float,
    while_waiting: Callable[[], None] | None = None,
) -> Response:
    """Ask ``service`` and wait for its answer; see :meth:`services.bus.Bus.call`."""
    if type(request) is not service.request:
        raise TypeError(f"{service.name} takes {service.request.__name__}, not {type(request).__name__}")
    payload = encode(request)
    begun = time.monotonic()
    while True:
        answer = _ask_once(session, key, payload, begun + timeout_s - time.monotonic(), while_waiting)
        if answer is not None:
            return decode(service.response, answer)
        waited = time.monotonic() - begun
        if waited >= timeout_s:
            raise CallError(f"{service.name}: no answer within {timeout_s:.1f} s")
        if waited >= _DISCOVERY_S:
            raise CallError(f"{service.name}: nobody answers; is the service running?")
        time.sleep(_RETRY_S)  # the service may have been started this moment


@dataclass(frozen=True)
class Answer:
    """What became of a question; neither field is set when there was nobody to answer.

    Attributes:
        payload: CDR of the response.
        refusal: Why there is none.
    """

    payload: bytes | None = None
    refusal: str | None = None


class Question:
    """One query under way; poll it for its answer."""

    def __init__(self, session: zenoh.Session, key: str, payload: bytes, timeout_s: float) -> None:
        """Ask; use :meth:`services.bus.Bus.ask`."""
        self._replies = session.get(
            key,
            handlers.FifoChannel(4),
            payload=payload,
            encoding=zenoh.Encoding("application/cdr"),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            timeout=max(0.01, timeout_s),
        )

    def poll(self) -> Answer | None:
        """The answer; ``None`` while it is still to come."""
        try:
            reply = self._replies.try_recv()
        except zenoh.ZError:  # the channel is closed: every queryable has had its say
            return Answer()
        if reply is None:
            return None
        if reply.ok is not None:
            return Answer(payload=reply.ok.payload.to_bytes())
        return Answer(refusal=reply.err.payload.to_bytes().decode(errors="replace") if reply.err else "")


def _ask_once(
    session: zenoh.Session, key: str, payload: bytes, timeout_s: float, while_waiting: Callable[[], None] | None
) -> bytes | None:
    """One query: the answer's payload, or ``None`` when there is nobody to answer."""
    question = Question(session, key, payload, timeout_s)
    pauses = _pauses_s()
    while (answer := question.poll()) is None:
        if while_waiting:
            while_waiting()
        time.sleep(next(pauses))
    if answer.refusal is not None:
        raise CallError(f"{key}: {answer.refusal}")
    return answer.payload
