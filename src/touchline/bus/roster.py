"""Discovers the robots on the bus by the liveliness tokens of all namespaces."""

import math
import time
from collections.abc import Iterable
from typing import Final

import zenoh
from zenoh import handlers

from touchline.bus.presence import EVERY_TOKEN, LivelinessReplies, namespace_of, parse_token, token_prefix
from touchline.schemas.topics import is_namespace

#: Most robots that are reported; a bus with more tokens than that is not ours.
MOST_ROBOTS: Final = 256
_COUNTED: Final = 16_384
_TIMEOUT_S: Final = 1.0
_EVERY_S: Final = 0.2
_POLL_S: Final = 0.005


class Roster:
    """Namespaces of the bus and their processes, counted anew five times per second by :meth:`poll`."""

    def __init__(self, session: zenoh.Session) -> None:
        """Start empty; use :meth:`touchline.bus.Bus.roster`."""
        self._session = session
        self._nodes: dict[str, set[str]] = {}
        self._counting: dict[str, set[str]] = {}
        self._replies: LivelinessReplies | None = None
        self._due_s = self._begun_s = 0.0
        self.counted_s = -math.inf
        """Start (monotonic) of the last complete count."""

    def poll(self) -> None:
        """Continue counting; never waits."""
        if self._replies is None:
            if time.monotonic() < self._due_s:
                return
            self._begun_s = time.monotonic()
            channel: handlers.FifoChannel[zenoh.Reply] = handlers.FifoChannel(_COUNTED)
            self._replies = self._session.liveliness().get(EVERY_TOKEN, channel, timeout=_TIMEOUT_S)
            self._counting = {}
        try:
            while (reply := self._replies.try_recv()) is not None:
                if reply.ok is not None:
                    self._note(str(reply.ok.key_expr))
        except zenoh.ZError:  # the channel is closed: all replies have come
            self._replies, self._nodes = None, self._counting
            self._due_s, self.counted_s = time.monotonic() + _EVERY_S, self._begun_s

    def robots(self, nodes: Iterable[str]) -> tuple[str, ...]:
        """Return namespaces with a process of one of these names, sorted, as of the last count."""
        wanted = set(nodes)
        return tuple(sorted(name for name, there in self._nodes.items() if wanted & there)[:MOST_ROBOTS])

    def look(self, nodes: Iterable[str], seconds: float = 0.0) -> tuple[str, ...]:
        """Return :meth:`robots` as counted after a delay: a process that joins learns of the others one by one."""
        least_s = time.monotonic() + seconds
        while self.counted_s < least_s:
            self.poll()
            time.sleep(_POLL_S)
        return self.robots(nodes)

    def _note(self, key: str) -> None:
        namespace = namespace_of(key)
        if not is_namespace(namespace):
            return
        token = parse_token(key, token_prefix(namespace))
        if token is not None:
            self._counting.setdefault(namespace, set()).add(token.node)
