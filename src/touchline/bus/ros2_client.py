"""Client of services that ROS 2 nodes serve, as rmw_zenoh implements it; everything is polled."""

import time
from typing import Final

import zenoh
from zenoh import handlers

from touchline.bus import attachment

_KNOWN: Final = 1024
_ANSWERS: Final = 8


class Ros2Response:
    """Response to one request; poll it.

    Attributes:
        payload: CDR of the response; whatever the server sent. ``None`` until it is there.
        problem: Why there is none; empty while it is still to come.
    """

    def __init__(self, session: zenoh.Session, key: str, payload: bytes, numbered: bytes, timeout_s: float) -> None:
        """Send the query; made by :class:`Ros2Client`."""
        self.payload: bytes | None = None
        self.problem = ""
        self._replies = session.get(
            key,
            handlers.FifoChannel(_ANSWERS),
            payload=payload,
            attachment=numbered,
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )

    def poll(self) -> bool:
        """Return whether it is there, or known not to come."""
        if self.payload is None and not self.problem:
            try:
                reply = self._replies.try_recv()
            except zenoh.ZError:  # the channel is closed: nobody has answered, or not in time
                self.problem = "no answer from the ROS 2 node"
            else:
                self._take(reply)
        return self.payload is not None or bool(self.problem)

    def _take(self, reply: zenoh.Reply | None) -> None:
        if reply is not None and reply.ok is not None:
            self.payload = reply.ok.payload.to_bytes()
        elif reply is not None and reply.err is not None:
            self.problem = reply.err.payload.to_bytes().decode(errors="replace") or "an error from the ROS 2 node"


class Ros2Client:
    """Client of one ROS 2 service.

    Args:
        session: Session among ROS 2 nodes.
        key: Key of the service.
        servers: Matches the liveliness tokens of those that serve it.
        gid: The client's 16-byte id.
    """

    def __init__(self, session: zenoh.Session, key: str, servers: str, gid: bytes) -> None:
        """Create the client; use :meth:`touchline.bus.ros2.Ros2Session.client`."""
        self._session = session
        self._key = key
        self._servers = servers
        self._gid = gid
        self._sequence = 0
        self._watch()

    def _watch(self) -> None:
        """Watch all servers anew. Nobody's tokens may hold up Zenoh's receiving threads, so the oldest give way."""
        self._alive: set[str] = set()
        self._changes = self._session.liveliness().declare_subscriber(
            self._servers, handlers.RingChannel(_KNOWN), history=True
        )

    def served(self) -> bool:
        """True if some node serves it."""
        taken = 0
        while taken < _KNOWN and (change := self._changes.try_recv()) is not None:
            taken += 1
            (self._alive.discard if change.kind == zenoh.SampleKind.DELETE else self._alive.add)(str(change.key_expr))
        if taken == _KNOWN:  # it was full, so a change may have been pushed out
            self._watch()
        return bool(self._alive)

    def ask(self, payload: bytes, timeout_s: float) -> Ros2Response:
        """Send a request (CDR)."""
        self._sequence += 1
        numbered = attachment.pack(self._sequence, time.time_ns(), self._gid)
        return Ros2Response(self._session, self._key, payload, numbered, timeout_s)
