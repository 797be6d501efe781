"""Acknowledged commands: typed queries that are always answered; an answer is trusted from its server only."""

import logging
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from typing import Final, Generic, NamedTuple, TypeAlias

import zenoh
from zenoh import handlers

from touchline.bus.counters import Counters
from touchline.bus.replies import Lane, Replies
from touchline.bus.service_gate import REFUSED, ServiceGate
from touchline.schemas.cdr import decode, encode, first_string
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.topics import Request, Response, Service
from touchline.security.audit_log import OrderAnswer

_LOG: Final = logging.getLogger(__name__)
#: Most waiting requests of a service; the oldest gives way, and its caller is notified at once. Zenoh's receiving
#: threads must never wait for room: an emergency stop may be behind.
_WAITING_CALLS: Final = 64
_WAITING_LARGE_CALLS: Final = 8
#: The same for a service that stops the robot: room for a flood between two polls, so that no stop gives way to it.
_WAITING_URGENT_CALLS: Final = 1024
_LARGE_BYTES: Final = 1024 * 1024
#: Most requests looked at in one poll, so that neither junk nor repeats can hold up the polling loop.
_LOOKED_AT: Final = 16
#: The same for a service that stops the robot; this many take 3 ms.
_LOOKED_AT_URGENT: Final = 128
#: Time for which an answer is remembered: no caller repeats a request after its own timeout, of which planning's is the
#: longest.
_REMEMBERED_S: Final = 600.0
_REMEMBERED_BYTES: Final = 32 * 1024 * 1024
_FIRST_POLL_S: Final = 0.00005
_POLL_GROWTH: Final = 1.1
_POLL_S: Final = 0.002
_RETRY_S: Final = 0.05
#: Time for which a call looks for its service before it reports that nobody answers.
_DISCOVERY_S: Final = 1.5
#: Time for which an answer is kept that arrives before its sender's liveliness token.
_TOKEN_S: Final = 0.5
_ANSWERS: Final = 64
SILENT: Final = "the service does not run, or hangs"
"""Reason to give where nobody answers: a process that hangs is off the bus after two seconds."""


class CallError(TouchlineError):
    """Call that was not answered, or answered with an error; the text is the reason."""


class AccessError(CallError):
    """Call that the caller's role does not admit; the text names the role that does."""


class ServedCall(Generic[Request, Response]):
    """One request, and its reply channel.

    Attributes:
        payload: CDR of the request.
        caller: Name of the caller's identity; empty on an open bus.
        request_id: Id of the request; empty if its type has none.
        repeat_id: Caller and id of the request, by which repeats are known; empty if its type has no id.
    """

    def __init__(self, server: "Server[Request, Response]", query: zenoh.Query, payload: bytes, caller: str) -> None:
        """Wrap a query; made by :class:`Server`."""
        self._server = server
        self.payload = payload
        self.caller = caller
        self.request_id = first_string(payload) if "request_id" in server.service.request.model_fields else ""
        self.repeat_id = f"{caller} {self.request_id}" if self.request_id else ""
        self.queries = [query]
        self._request: Request | None = None

    @property
    def request(self) -> Request:
        """The request, decoded at the first access; in any thread.

        Raises:
            PayloadError: The payload is not a request of this service.
        """
        if self._request is None:
            self._request = decode(self._server.service.request, self.payload)
        return self._request

    def reply(self, response: Response) -> None:
        """Answer; repeats of the same request id get this answer too."""
        self.reply_bytes(encode(response))

    def reply_bytes(self, payload: bytes) -> None:
        """Answer with CDR of the response; see :meth:`reply`."""
        self._server.finish(self, payload)

    def fail(self, reason: str) -> None:
        """Answer with an error, for problems outside the request's own meaning."""
        self._server.abandon(self, reason)

    def reject(self, error: PayloadError) -> None:
        """Answer a payload that is no request of this service with an error, and count it."""
        self._server.reject(self, error)


class Server(Generic[Request, Response]):
    """Server of one service.

    Invalid requests are answered with an error and counted; a request id that was answered already gets the same answer
    again and does nothing.
    """

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        service: Service[Request, Response],
        counters: Counters,
        replies: Replies,
        gate: ServiceGate,
    ) -> None:
        """Declare the queryable; use :meth:`touchline.bus.Bus.serve`."""
        self.service = service
        self._gate = gate
        self._replies = replies
        self._key = key
        self._counters = counters
        self._answers = Answers()
        self._open: dict[str, ServedCall[Request, Response]] = {}
        room = _WAITING_LARGE_CALLS if service.most_bytes > _LARGE_BYTES else _WAITING_CALLS
        self._looked_at = _LOOKED_AT
        if service.urgent:
            room, self._looked_at = _WAITING_URGENT_CALLS, _LOOKED_AT_URGENT
        self._room = room
        self._pauses_s: Iterator[float] = repeat(_POLL_S)
        self._queryables: list[_Queryable] = []
        self._at_door: list[_Queryable] = []
        self.declare(session)

    def declare(self, session: zenoh.Session) -> None:
        """Serve by this session, and answer requests by the one before as long as that is open."""
        self._queryables = [*self._queryables[-1:], self._declared(session)]

    def declare_at_door(self, session: zenoh.Session) -> None:
        """Serve by the session of the robot's own door, too; in place of the one before."""
        self._at_door = [self._declared(session)]

    def _declared(self, session: zenoh.Session) -> "_Queryable":
        key = self._gate.served_key(self._key)
        return session.declare_queryable(key, handlers.RingChannel(self._room), complete=True)

    def close(self) -> None:
        """Stop serving; waiting requests are not answered."""
        for queryable in (*self._queryables, *self._at_door):
            with suppress(zenoh.ZError):  # its session is closed
                queryable.undeclare()  # type: ignore[no-untyped-call]
        self._queryables, self._at_door = [], []

    def _received(self) -> zenoh.Query | None:
        for queryable in (*self._queryables, *self._at_door):
            try:
                query = queryable.try_recv()
            except zenoh.ZError:  # its session is closed
                continue
            if query is not None:
                return query
        return None

    def poll(self) -> ServedCall[Request, Response] | None:
        """Return the next request, if one waits."""
        looks = iter(range(self._looked_at))
        while (call := self._unread(looks)) is not None:
            try:
                assert call.request is not None
            except PayloadError as error:
                call.reject(error)
                continue
            return call
        return None

    def poll_unread(self) -> ServedCall[Request, Response] | None:
        """Return the next request, if one waits, not decoded yet; it may turn out to be invalid."""
        return self._unread(iter(range(self._looked_at)))

    def _unread(self, looks: Iterator[int]) -> ServedCall[Request, Response] | None:
        """Return the next request, looking at no more than there are `looks`."""
        for _ in looks:
            query = self._received()
            if query is None:
                return None
            if (call := self._admit(query)) is not None:
                self._counters.received += 1
                return call
        return None

    def wait(self, timeout_s: float) -> ServedCall[Request, Response] | None:
        """Wait up to ``timeout_s`` for a request, polling more closely for a while after each."""
        deadline = time.monotonic() + timeout_s
        while (call := self.poll()) is None and time.monotonic() < deadline:
            time.sleep(next(self._pauses_s))
        if call is not None:
            self._pauses_s = _pauses_s()
        return call

    def _admit(self, query: zenoh.Query) -> ServedCall[Request, Response] | None:
        caller = self._gate.caller(str(query.key_expr), self._key)
        problem = self._problem(query, caller)
        if problem or caller is None:
            self._counters.reject(f"{self.service.name}: {problem}")
            self._gate.note(caller or "", self.service, OrderAnswer.REFUSED, problem)
            self._refuse(query, problem)
            return None
        payload = query.payload.to_bytes() if query.payload is not None else b""
        call = ServedCall(self, query, payload, caller)
        if (answer := self._answers.find(call.repeat_id, time.monotonic())) is not None:
            self._answer(query, answer, Lane.OTHER)
            return None
        if call.repeat_id in self._open:
            first = self._open[call.repeat_id]
            first.queries = [*first.queries[-_WAITING_CALLS:], query]
            return None
        if call.repeat_id:
            self._open[call.repeat_id] = call
        return call

    def _problem(self, query: zenoh.Query, caller: str | None) -> str:
        """Return why a query is refused undecoded; empty if it may be a request."""
        if caller is None:
            return f"asked for by {query.key_expr}; a service is asked by its own key, {self._key}"
        size = len(query.payload) if query.payload is not None else 0
        if size > self.service.most_bytes:
            return f"a request of {size:,} bytes; at most {self.service.most_bytes:,} are read"
        return self._gate.problem(caller, self.service)

    def finish(self, call: ServedCall[Request, Response], payload: bytes) -> None:
        """Send ``payload`` to all callers with this call's id, and remember it."""
        if call.repeat_id:
            self._open.pop(call.repeat_id, None)
            self._answers.remember(call.repeat_id, payload, time.monotonic())
        if self._gate.notes(self.service):
            self._gate.note(call.caller, self.service, *self._outcome(payload))
        first, *others = call.queries
        self._answer(first, payload, Lane.STOP if self.service.urgent else Lane.FIRST)
        for query in others:
            self._answer(query, payload, Lane.OTHER)

    def _outcome(self, payload: bytes) -> tuple[OrderAnswer, str]:
        """Return how a request was answered, and the message; a plan is too large to be looked into."""
        if len(payload) > _LARGE_BYTES:
            return OrderAnswer.ACCEPTED, ""
        response = decode(self.service.response, payload)
        answer = OrderAnswer.ACCEPTED if getattr(response, "success", True) else OrderAnswer.REFUSED
        return answer, getattr(response, "message", "")

    def abandon(self, call: ServedCall[Request, Response], reason: str) -> None:
        """Send an error to all callers with this call's id; the same id may be tried again."""
        self._open.pop(call.repeat_id, None)
        self._gate.note(call.caller, self.service, OrderAnswer.ERROR, reason)
        for query in call.queries:
            self._refuse(query, reason)

    def reject(self, call: ServedCall[Request, Response], error: PayloadError) -> None:
        """Count an invalid request, and answer its sender with the error."""
        self._counters.received -= 1
        self._counters.reject(f"{self.service.name}: {error}")
        self.abandon(call, str(error))

    def _answer(self, query: zenoh.Query, payload: bytes, lane: Lane) -> None:
        self._replies.send(lane, partial(_reply, query, payload))
        self._counters.published += 1

    def _refuse(self, query: zenoh.Query, reason: str) -> None:
        self._replies.send(Lane.OTHER, partial(_reply_error, query, reason))


class Answers:
    """Answers by request id, for as long as a repeat of the request can come."""

    def __init__(self) -> None:
        """Start without answers."""
        self._kept: OrderedDict[str, tuple[bytes, float]] = OrderedDict()
        self._bytes = 0

    def find(self, request_id: str, now_s: float) -> bytes | None:
        """Return the answer to a request of this id."""
        while self._kept and next(iter(self._kept.values()))[1] < now_s - _REMEMBERED_S:
            self._forget_oldest()
        found = self._kept.get(request_id)
        return found[0] if found is not None else None

    def remember(self, request_id: str, answer: bytes, now_s: float) -> None:
        """Keep an answer; where there is no room, the oldest are dropped."""
        self._kept[request_id] = (answer, now_s)
        self._bytes += len(request_id) + len(answer)
        while self._bytes > _REMEMBERED_BYTES and len(self._kept) > 1:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        request_id, (answer, _) = self._kept.popitem(last=False)
        self._bytes -= len(request_id) + len(answer)


def _pauses_s() -> Iterator[float]:
    """Yield pauses between two polls: short at first, since most answers come at once, then longer."""
    pause_s = _FIRST_POLL_S
    while True:
        yield pause_s
        pause_s = min(_POLL_GROWTH * pause_s, _POLL_S)


def _reply(query: zenoh.Query, payload: bytes) -> None:
    with query:
        query.reply(query.key_expr, payload, encoding=zenoh.Encoding("application/cdr"))


def _reply_error(query: zenoh.Query, reason: str) -> None:
    with query:
        query.reply_err(reason.encode(), encoding=zenoh.Encoding.TEXT_PLAIN)


@dataclass(frozen=True)
class Answer:
    """Outcome of a query; without the first two, nobody answered.

    Attributes:
        payload: CDR of the response.
        refusal: Why there is none.
        untrusted: Whether a session answered that is not the service's server.
        late: Whether somebody was asked who did not answer in time.
    """

    payload: bytes | None = None
    refusal: str | None = None
    untrusted: bool = False
    late: bool = False


class _Reply(NamedTuple):
    """Reply, and the session that it came from."""

    answer: Answer
    session: str


_Queryable: TypeAlias = "zenoh.Queryable[handlers.Handler[zenoh.Query]]"
Trusted = Callable[[str], bool]
"""Predicate on a session: whether it belongs to the service's server."""


class Question:
    """Query in progress; poll it for its answer."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        service: Service[Request, Response],
        payload: bytes,
        timeout_s: float,
        trusted: Trusted,
    ) -> None:
        """Send the query; use :meth:`touchline.bus.Bus.ask`."""
        self._trusted = trusted
        self._doubted: list[_Reply] = []
        self._late = False
        self._closed_at: float | None = None
        self._replies = session.get(
            key,
            handlers.FifoChannel(_ANSWERS),
            payload=payload,
            encoding=zenoh.Encoding("application/cdr"),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.REAL_TIME if service.urgent else zenoh.Priority.DATA,
            express=service.urgent,
            timeout=max(0.01, timeout_s),
        )

    def poll(self) -> Answer | None:
        """Return the answer; ``None`` while it is still to come."""
        while self._closed_at is None:
            try:
                reply = self._replies.try_recv()
            except zenoh.ZError:  # the channel is closed: every queryable has answered or given none
                self._closed_at = time.monotonic()
                break
            if reply is None:
                break
            if _is_timeout(reply):
                self._late = True
                continue
            self._doubted = [*self._doubted[-_ANSWERS:], _Reply(_answer_of(reply), _session_of(reply))]
        for doubted in self._doubted:
            if self._trusted(doubted.session):
                return doubted.answer
        if self._closed_at is None or (self._doubted and time.monotonic() < self._closed_at + _TOKEN_S):
            return None
        return Answer(untrusted=bool(self._doubted), late=self._late)


def _is_timeout(reply: zenoh.Reply) -> bool:
    """Return whether Zenoh itself replied, in the name of a session that has not, a router's or nobody's."""
    return reply.err is not None and reply.err.payload.to_bytes() == b"Timeout"


def _answer_of(reply: zenoh.Reply) -> Answer:
    if reply.ok is not None:
        return Answer(payload=reply.ok.payload.to_bytes())
    return Answer(refusal=reply.err.payload.to_bytes().decode(errors="replace") if reply.err else "")


def _session_of(reply: zenoh.Reply) -> str:
    """Return the id of the session that replied; Zenoh notes it, not the sender."""
    return str(reply.replier_id.zid) if reply.replier_id is not None else ""


def call(
    ask: Callable[[Service[Request, Response], bytes, float], Question],
    service: Service[Request, Response],
    request: Request,
    timeout_s: float,
    while_waiting: Callable[[], None] | None = None,
    why: Callable[[], str] = lambda: SILENT,
) -> Response:
    """Call ``service`` and wait for its answer; see :meth:`touchline.bus.Bus.call`.

    ``why`` returns the reason to report when nobody answers.
    """
    if type(request) is not service.request:
        raise TypeError(f"{service.name} takes {service.request.__name__}, not {type(request).__name__}")
    payload = encode(request)
    if len(payload) > service.most_bytes:
        raise CallError(f"{service.name}: a request of {len(payload):,} bytes; at most {service.most_bytes:,} are read")
    begun = time.monotonic()
    while True:
        answer = _wait(ask(service, payload, begun + timeout_s - time.monotonic()), while_waiting)
        if answer.refusal is not None:
            kind = AccessError if answer.refusal.startswith(REFUSED) else CallError
            raise kind(f"{service.name}: {answer.refusal}")
        if answer.payload is not None:
            _LOG.debug("%s answered %d bytes in %.3f s", service.name, len(answer.payload), time.monotonic() - begun)
            return decode(service.response, answer.payload)
        waited = time.monotonic() - begun
        if waited >= min(timeout_s, _DISCOVERY_S) and answer.untrusted:
            raise CallError(f"{service.name}: only a session that is not {service.server} answers; that is not trusted")
        if waited >= timeout_s or answer.late:
            raise CallError(f"{service.name}: no answer within {timeout_s:.1f} s")
        if waited >= _DISCOVERY_S:
            raise CallError(f"{service.name}: nobody answers; {why()}")
        time.sleep(_RETRY_S)  # the service may have been started this moment


def _wait(question: Question, while_waiting: Callable[[], None] | None) -> Answer:
    pauses = _pauses_s()
    while (answer := question.poll()) is None:
        if while_waiting:
            while_waiting()
        time.sleep(next(pauses))
    return answer
