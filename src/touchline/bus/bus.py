"""Connection of a process to the bus."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from typing import Any, Final, Literal, Self, TypeAlias
from weakref import WeakSet

import zenoh

from touchline.bus import calls
from touchline.bus.access_control import is_at_door
from touchline.bus.attachment import session_publisher
from touchline.bus.caller import asked_key
from touchline.bus.calls import SILENT, Question, Server
from touchline.bus.claim import claim
from touchline.bus.common_settings import PATIENCE_S
from touchline.bus.config import BusConfig, Door
from touchline.bus.counters import Counters
from touchline.bus.identity_check import check_identity
from touchline.bus.inbox import Inbox
from touchline.bus.joining import join, join_at_door, leave
from touchline.bus.last_sent import LastSent
from touchline.bus.link_log import LinkLog
from touchline.bus.own_door import OwnDoor
from touchline.bus.presence import Presence, token_prefix
from touchline.bus.prompt import PromptPublisher
from touchline.bus.publisher import Publisher
from touchline.bus.replies import Replies
from touchline.bus.roster import Roster
from touchline.bus.service_gate import ServiceGate
from touchline.bus.trusted_sessions import TrustedSessions
from touchline.schemas.topics import SERVING, Request, Response, Service, Topic
from touchline.schemas.user_folders import keys_folder
from touchline.security.identity import IDENTITIES

_MOST_NAMED: Final = 12
#: Time to answer requests that came by a former session.
_ANSWERED_S: Final = 2.0
_Membership: TypeAlias = tuple[zenoh.Session, zenoh.LivelinessToken]


class Bus:
    """Typed topics, services and presence of one robot; everything is polled, nothing calls back.

    A process that acts for several robots has a bus for each, all of one session.

    Attributes:
        node: This process's name on the bus.
        counters: Messages published, received, lost and rejected here.
    """

    def __init__(self, session: zenoh.Session, node: str, config: BusConfig, patience_s: float = PATIENCE_S) -> None:
        """Take an open session; use :meth:`open`."""
        self.node = node
        self.config = config
        self.counters = Counters()
        self._session = session
        self._former: list[_Membership] = []
        self._patience_s = patience_s
        self._declared: WeakSet[Inbox | Presence | Publisher | Server[Any, Any]] = WeakSet()
        self.opened_s = time.monotonic()
        self._trusted = TrustedSessions(self.presence)
        self._replies = Replies()
        self._caller = config.identity.name if config.identity is not None else ""
        self._gate = ServiceGate(node, config)
        self._door: OwnDoor | None = None
        self._others: list[Bus] = []
        self._token = self._declare_token(session)

    def _declare_token(self, session: zenoh.Session) -> zenoh.LivelinessToken:
        key = f"{token_prefix(self.config.namespace)}/{self.node}/{session.zid()}"
        return session.liveliness().declare_token(key)

    @classmethod
    @contextmanager
    def open(
        cls,
        node: str,
        config: BusConfig | None = None,
        stop: Callable[[], object] | None = None,
        patience_s: float = PATIENCE_S,
    ) -> Iterator[Self]:
        """Join the bus as ``node``; leaving the context leaves the bus.

        Warns on standard error if other machines can reach it.

        Args:
            node: This process's name.
            config: Bus configuration; from the environment if not given.
            stop: An absent router is waited for until this returns true; if it is not given, for a few seconds.
            patience_s: A peer that does not take a message for this long is cut off; it may join again.

        Raises:
            SpecError: The configuration cannot be used.
            TouchlineError: The bus cannot be joined.
            KeyboardInterrupt: ``stop()`` was true before the bus was joined.
        """
        config = config or BusConfig.from_environment()
        check_identity(node, config)
        session = join(config, node, None if stop is None else lambda: bool(stop()), patience_s)
        with (
            cls._of(session, node, config, patience_s) as bus,
            closing(LinkLog(config, bus._is_linked)) if config.identity is not None else nullcontext(),
        ):
            yield bus

    @classmethod
    @contextmanager
    def open_all(
        cls,
        node: str,
        config: BusConfig,
        stop: Callable[[], object] | None = None,
        patience_s: float = PATIENCE_S,
    ) -> Iterator[tuple[Self, ...]]:
        """Join the bus like :meth:`open`, for each of the robots of ``config``, in their order."""
        first, *others = config.namespaces
        with cls.open(node, config.of(first), stop, patience_s) as bus:
            yield (bus, *(bus.of(namespace) for namespace in others))

    @classmethod
    @contextmanager
    def open_at_door(cls, node: str, config: BusConfig, door: Door, stop: Callable[[], bool]) -> Iterator[Self]:
        """Open a session with the robot alone, at its own door, so that nobody else can delay it.

        Raises:
            TouchlineError: Nobody answers there.
            KeyboardInterrupt: ``stop()`` was true first.
        """
        with cls._of(join_at_door(config, door, stop), node, config) as bus:
            yield bus

    def open_door(self) -> None:
        """Let this bus's robot be stopped at its own door; on an open bus, whose robots are peers, it is there already.

        Raises:
            TouchlineError: It cannot listen there.
        """
        if self.config.identity is not None:
            self._door = OwnDoor(self.config, self._declare_at_door)

    def _declare_at_door(self, session: zenoh.Session) -> zenoh.LivelinessToken:
        for each in list(self._declared):
            if isinstance(each, Server) and is_at_door(each.service):
                each.declare_at_door(session)
        return self._declare_token(session)

    @classmethod
    @contextmanager
    def _of(
        cls, session: zenoh.Session, node: str, config: BusConfig, patience_s: float = PATIENCE_S
    ) -> Iterator[Self]:
        sessions = [session]
        try:
            bus = cls(session, node, config, patience_s)  # held here: the liveliness token goes with it
            try:
                yield bus
            finally:
                bus._close()
                sessions = [bus._session, *(former for former, _ in bus._former)]
        finally:
            for each in sessions:
                leave(each)

    def _close(self) -> None:
        for bus in (self, *self._others):
            bus._replies.close()
            bus._gate.close()
        if self._door is not None:
            self._door.close()

    @property
    def session_id(self) -> str:
        """Id of this process's session, as in its liveliness token."""
        return str(self._session.zid())

    @property
    def publisher_id(self) -> bytes:
        """Publisher id by which receivers recognise this session; for one publisher of a topic."""
        return session_publisher(self.session_id)

    def peers(self) -> frozenset[str]:
        """Return the ids of the sessions that this one has a link to."""
        return frozenset(map(str, (*self._session.info.peers_zid(), *self._session.info.routers_zid())))

    def _is_linked(self) -> bool:
        try:
            return bool(self.peers())
        except zenoh.ZError:  # the session is closed, for another one or for good
            return True

    def rejoin(self, stop: Callable[[], object]) -> None:
        """Join the bus again, with all that was declared here: a peer that has cut this process off never comes back.

        Zenoh reconnects only to the endpoints of its configuration, not to peers that it has learned of by gossip.
        Until :meth:`leave_former`, inboxes continue with what arrives by the former session, and requests that came by
        it can be answered. Of latched topics late joiners get nothing before the next message.

        Args:
            stop: Called often; waiting for an absent router ends when this returns true.

        Raises:
            TouchlineError: The bus cannot be joined; nothing has changed.
            KeyboardInterrupt: ``stop()`` was true first.
        """
        self.leave_former()
        session = join(self.config, self.node, lambda: bool(stop()), self._patience_s)
        for bus in (self, *self._others):
            stop()
            bus._move(session)

    def _move(self, session: zenoh.Session) -> None:
        self._former.append((self._session, self._token))
        self._session, self._token = session, self._declare_token(session)
        for each in list(self._declared):
            each.declare(session)

    def leave_former(self) -> None:
        """Continue only with the session of :meth:`rejoin`; the former one is soon closed."""
        for bus in (self, *self._others):
            for each in list(bus._declared):
                if isinstance(each, Inbox):
                    each.leave_former()
        former = [each for bus in (self, *self._others) for each in bus._former]
        for bus in (self, *self._others):
            bus._former = []
        if former:
            closing = threading.Timer(_ANSWERED_S, _leave_all, (former,))
            closing.daemon = True
            closing.start()

    def of(self, namespace: str) -> Self:
        """Return the bus of another robot in the same session, with its own counters and answering threads."""
        other = type(self)(self._session, self.node, self.config.of(namespace), self._patience_s)
        other.opened_s = self.opened_s
        self._others.append(other)  # held here: its liveliness token goes with it
        return other

    def rename(self, node: str) -> None:
        """Be another process from now on, in the same session; buses of other robots that it had are left.

        Args:
            node: The name, of the same role.
        """
        tokens = [bus._token for bus in (self, *self._others)]
        for other in self._others:
            other._close()
        self._gate.close()
        self.node, self._gate, self._others = node, ServiceGate(node, self.config), []
        self._token = self._declare_token(self._session)
        for token in tokens:
            token.undeclare()  # type: ignore[no-untyped-call]

    @property
    def namespace(self) -> str:
        """Namespace of the robot."""
        return self.config.namespace

    def roster(self) -> Roster:
        """Return a view of the robots on the bus."""
        return Roster(self._session)

    def claim(self) -> None:
        """Make sure that no other process of this name serves, because two would answer the same requests.

        A namesake that does not answer, such as a stranger's token, is reported in the log and on the bus.

        Raises:
            TouchlineError: Another one serves.
        """
        claim(self, self._session, self.opened_s)

    def key(self, name: str) -> str:
        """Return the key of a topic or service name."""
        return f"{self.config.namespace}/{name}"

    def asked_key(self, service: Service[Any, Any]) -> str:
        """Return the key by which this process asks for a service."""
        return asked_key(self.key(service.name), self._caller)

    def publisher(self, topic: Topic, publisher_id: bytes | None = None) -> Publisher:
        """Declare a publisher of ``topic``, with an id of its own or a given one of 16 bytes."""
        publisher = Publisher(self._session, self.key(topic.name), topic, self.counters, publisher_id)
        self._declared.add(publisher)
        return publisher

    def prompt_publisher(self, topic: Topic, publisher_id: bytes) -> PromptPublisher:
        """Declare a publisher of prompt copies of what the publisher with this id sends, perhaps by another session."""
        return PromptPublisher(self._session, self.key(topic.name), publisher_id)

    def begin_anew(self, publisher: Publisher, publisher_id: bytes) -> None:
        """Let a publisher of this bus continue as another one; see :meth:`Publisher.begin_anew`."""
        publisher.begin_anew(self._session, publisher_id)

    def sent(self) -> list[LastSent]:
        """Return what was sent here of each recorded topic."""
        ours = [each for each in self._declared if isinstance(each, Publisher) and each.topic.recorded]
        return [LastSent(each.topic.name, each.id, each.sequence) for each in ours]

    def inbox(self, topics: Sequence[Topic], keep: Literal["all", "recent", "latest"] = "all") -> Inbox:
        """Subscribe to ``topics``; see :class:`Inbox` for ``keep``."""
        inbox = Inbox(self._session, self.namespace, topics, keep, self.counters)
        self._declared.add(inbox)
        return inbox

    def serve(self, service: Service[Request, Response]) -> Server[Request, Response]:
        """Declare a server of ``service``."""
        server = Server(self._session, self.key(service.name), service, self.counters, self._replies, self._gate)
        self._declared.add(server)
        if self._door is not None and is_at_door(service):
            self._door.declare(server.declare_at_door)
        return server

    def call(
        self,
        service: Service[Request, Response],
        request: Request,
        timeout_s: float = 5.0,
        while_waiting: Callable[[], None] | None = None,
    ) -> Response:
        """Call ``service`` and wait for its answer, calling ``while_waiting`` every few milliseconds.

        Only an answer of the service's own server is trusted: of a session with that node's liveliness token.

        Args:
            service: Row of the topic table.
            request: The request.
            timeout_s: Wall-clock time for the answer.
            while_waiting: Called every few milliseconds; may raise to end the wait.

        Raises:
            CallError: Nobody answers within ``timeout_s``, or the answer is an error.
            PayloadError: The answer is not a response of this service.
        """
        return calls.call(self.ask, service, request, timeout_s, while_waiting, self._why_nobody)

    def _why_nobody(self) -> str:
        robots = self.roster().look(SERVING)
        if not robots and self.config.identity is None and (keys_folder() / IDENTITIES).is_dir():
            return f"no robot is on the open bus at {self.config.endpoint}; a secured one takes --identity"
        if not robots or self.namespace in robots:
            return SILENT
        there = (
            robots[0] if len(robots) == 1 else f"{', '.join(robots[:_MOST_NAMED])}{' …' * (len(robots) > _MOST_NAMED)}"
        )
        return f"there is no robot {self.namespace} on the bus, but {there}; name one with --robot"

    def ask(self, service: Service[Any, Any], payload: bytes, timeout_s: float) -> Question:
        """Send a request in CDR and return at once; unlike :meth:`call` without looking for the service."""
        trusted = self._trusted.trusted(service.server)
        return Question(self._session, self.asked_key(service), service, payload, timeout_s, trusted)

    def ask_session(self, session: str, service: Service[Any, Any], payload: bytes, timeout_s: float) -> Question:
        """Send a request like :meth:`ask`, and take only the answer of the process with this session."""
        key = self.asked_key(service)
        return Question(self._session, key, service, payload, timeout_s, lambda who: who == session)

    def sessions(self, node: str) -> frozenset[str]:
        """Return the sessions of all processes of a name, by their liveliness tokens."""
        return self._trusted.sessions(node)

    def presence(self) -> Presence:
        """Return a view of the processes on the bus."""
        presence = Presence(self._session, self.config.namespace)
        self._declared.add(presence)
        return presence

    def wait_for(self, nodes: set[str], timeout_s: float) -> set[str]:
        """Wait until all of ``nodes`` are on the bus; return those that are still missing."""
        presence = self.presence()
        deadline = time.monotonic() + timeout_s
        while True:
            presence.poll()
            missing = nodes - presence.alive()
            if not missing or time.monotonic() > deadline:
                return missing
            time.sleep(0.005)


def _leave_all(memberships: Iterable[_Membership]) -> None:
    """Close the sessions, whose tokens are held until then."""
    for session, _ in memberships:
        leave(session, 0.0)
