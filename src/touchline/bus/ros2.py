"""Second Zenoh session, among ROS 2 nodes that use rmw_zenoh.

It shares nothing with the bus: what ROS 2 nodes publish, ask or break stays on this side.
"""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Self

import zenoh
from zenoh import ext, handlers

from touchline.bus import attachment
from touchline.bus.attachment import Attachment
from touchline.bus.ros2_client import Ros2Client
from touchline.schemas.errors import SpecError, TouchlineError

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"

_CONNECT_TIMEOUT_MS = 3000
_WAITING_REQUESTS = 64
_WAITING_MESSAGES = 16
_KNOWN_TOKENS = 1024


@dataclass(frozen=True)
class Ros2Endpoint:
    """Meeting point with ROS 2 nodes.

    Attributes:
        locator: Zenoh locator.
        listen: Be the router there, in place of ``rmw_zenohd``; otherwise join the router that is there.
    """

    locator: str = DEFAULT_ENDPOINT
    listen: bool = True

    @property
    def option(self) -> str:
        """Option of the command line that sets it."""
        return "--ros2-listen" if self.listen else "--ros2-connect"

    def __post_init__(self) -> None:
        """Refuse values that Zenoh could not use."""
        protocol, _, address = self.locator.partition("/")
        if not protocol.isalnum() or not address:
            problem, remedy = f"is {self.locator!r}", f"give a locator like {DEFAULT_ENDPOINT}"
            raise SpecError("command line", self.option, problem, remedy)

    def zenoh(self) -> zenoh.Config:
        """Return the Zenoh session configuration: that of rmw_zenoh's router, or of one of its nodes."""
        config = zenoh.Config()
        for key, value in self._settings().items():
            config.insert_json5(key, json.dumps(value))
        return config

    def _settings(self) -> dict[str, Any]:
        return {
            "mode": "router" if self.listen else "peer",
            "scouting/multicast/enabled": False,
            # Opening waits this long for others to show up.
            "scouting/delay": 100,
            "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
            # Samples kept for late joiners are distinguished by their time.
            "timestamping/enabled": True,
            "listen/endpoints": [self.locator if self.listen else "tcp/127.0.0.1:0"],
            "listen/exit_on_failure": True,
            "connect/endpoints": [] if self.listen else [self.locator],
            "connect/timeout_ms": _CONNECT_TIMEOUT_MS,
            "connect/exit_on_failure": True,
            "transport/shared_memory/enabled": False,
        }


class Ros2Session:
    """Publishers, servers and liveliness tokens under keys that the caller spells; everything is polled."""

    def __init__(self, session: zenoh.Session) -> None:
        """Wrap a session; use :meth:`open`."""
        self._session = session
        self._tokens: list[zenoh.LivelinessToken] = []

    @classmethod
    @contextmanager
    def open(cls, endpoint: Ros2Endpoint) -> Iterator[Self]:
        """Meet ROS 2 nodes at ``endpoint`` until the context is left.

        Raises:
            TouchlineError: The endpoint cannot be listened on, or nobody is there to connect to.
        """
        zenoh.init_log_from_env_or("off")
        try:
            session = zenoh.open(endpoint.zenoh())
        except zenoh.ZError as error:
            raise TouchlineError(_why_not(endpoint)) from error
        with session:
            ours = cls(session)  # held here: the liveliness tokens go with it
            yield ours

    @property
    def id(self) -> str:
        """Zenoh id of the session, as rmw_zenoh writes it."""
        return str(self._session.zid())

    def declare_token(self, key: str) -> None:
        """Declare a liveliness token for as long as the session is open."""
        self._tokens.append(self._session.liveliness().declare_token(key))

    def tokens(self, key_expression: str) -> list[str]:
        """Return matching liveliness tokens of others."""
        replies = self._session.liveliness().get(key_expression, handlers.FifoChannel(_KNOWN_TOKENS))
        return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

    def publisher(self, key: str, gid: bytes, *, latched: bool) -> "Ros2Publisher":
        """Declare a publisher; late joiners get the last message of a ``latched`` one."""
        return Ros2Publisher(self._session, key, gid, latched=latched)

    def watch(self, key: str) -> Callable[[], bool]:
        """Return a function that reports whether somebody subscribes to a key."""
        publisher = self._session.declare_publisher(key)
        return lambda: bool(publisher.matching_status.matching)  # type: ignore[attr-defined]  # they say bool

    def subscribe(self, key: str) -> "Ros2Subscriber":
        """Subscribe to a topic."""
        return Ros2Subscriber(self._session, key)

    def client(self, key: str, servers: str, gid: bytes) -> Ros2Client:
        """Create a client of a service, whose servers have liveliness tokens that match ``servers``."""
        return Ros2Client(self._session, key, servers, gid)

    def serve(self, key: str) -> "Ros2Server":
        """Declare a server of a service."""
        return Ros2Server(self._session, key)


class Ros2Publisher:
    """Publishes as rmw_zenoh does: a client that does not keep up loses messages rather than holding anyone up."""

    def __init__(self, session: zenoh.Session, key: str, gid: bytes, *, latched: bool) -> None:
        """Declare the publisher; use :meth:`Ros2Session.publisher`."""
        self._gid = gid
        self._put = self._declare(session, key, latched).put

    @staticmethod
    def _declare(session: zenoh.Session, key: str, latched: bool) -> zenoh.Publisher | ext.AdvancedPublisher:
        control = zenoh.CongestionControl.DROP
        if not latched:
            return session.declare_publisher(key, congestion_control=control)
        return ext.declare_advanced_publisher(
            session,
            key,
            congestion_control=control,
            cache=ext.CacheConfig(max_samples=1),
            publisher_detection=True,
        )

    def send(self, payload: bytes, sequence: int, source_time_ns: int) -> None:
        """Publish ``payload`` (CDR) under its number, from 1, and the time at which it was first sent."""
        self._put(payload, attachment=attachment.pack(sequence, source_time_ns, self._gid))


class Ros2Subscriber:
    """Messages of others; if they are not taken, the oldest give way."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        """Declare the subscription; use :meth:`Ros2Session.subscribe`."""
        self._subscriber = session.declare_subscriber(key, handlers.RingChannel(_WAITING_MESSAGES))

    def take(self) -> list[bytes]:
        """Return the payloads (CDR, or whatever was sent) that have come since the last call."""
        taken: list[bytes] = []
        while len(taken) < _WAITING_MESSAGES and (sample := self._subscriber.try_recv()) is not None:
            taken.append(sample.payload.to_bytes())
        return taken


class Ros2Request:
    """One request, and its reply channel.

    Attributes:
        payload: CDR of the request; whatever the client sent.
        client: The client's numbering, which the response repeats; ``None`` if there is none.
    """

    def __init__(self, query: zenoh.Query, key: str) -> None:
        """Wrap a query; made by :class:`Ros2Server`."""
        self.payload = query.payload.to_bytes() if query.payload is not None else b""
        self.client: Attachment | None = None
        if query.attachment is not None:
            self.client = attachment.unpack(query.attachment.to_bytes())
        self._query = query
        self._key = key

    def reply(self, payload: bytes) -> None:
        """Answer with ``payload`` (CDR of the response)."""
        assert self.client is not None
        numbered = attachment.pack(self.client.sequence, time.time_ns(), self.client.publisher)
        with self._query as query:
            query.reply(self._key, payload, attachment=numbered)

    def fail(self, reason: str) -> None:
        """Answer the request with an error."""
        with self._query as query:
            query.reply_err(reason.encode(), encoding=zenoh.Encoding.TEXT_PLAIN)


class Ros2Server:
    """Server of one ROS 2 service."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        """Declare the server; use :meth:`Ros2Session.serve`."""
        self._key = key
        self._queryable = session.declare_queryable(key, handlers.FifoChannel(_WAITING_REQUESTS), complete=True)

    def poll(self) -> Ros2Request | None:
        """Return the next request, if one waits."""
        query = self._queryable.try_recv()
        return Ros2Request(query, self._key) if query is not None else None


def _why_not(endpoint: Ros2Endpoint) -> str:
    if endpoint.listen:
        return (
            f"{endpoint.option} {endpoint.locator}: cannot listen there; if a Zenoh router or another gateway does, "
            f"join it with --ros2-connect {endpoint.locator}, or listen elsewhere"
        )
    return (
        f"{endpoint.option} {endpoint.locator}: nobody answers there; start the router "
        f"(ros2 run rmw_zenoh_cpp rmw_zenohd), or be one with --ros2-listen {endpoint.locator}"
    )
