"""Authentication of answers: only sessions with the liveliness token of the serving node may answer.

A replay may, too, for the processes of the robot that it replays: they are not there.
"""

import threading
from collections.abc import Callable

from touchline.bus.presence import Presence
from touchline.schemas.topics import REPLAY, REPLAYED


class TrustedSessions:
    """Trusted sessions by node; thread-safe."""

    def __init__(self, watch: Callable[[], Presence]) -> None:
        """Watch presence from the first query on."""
        self._watch = watch
        self._presence: Presence | None = None
        self._lock = threading.Lock()

    def trusted(self, node: str) -> Callable[[str], bool]:
        """Return a predicate on sessions of ``node``; every session passes if a service names no node."""
        if not node:
            return lambda session: True
        self._begin()
        nodes = (node, REPLAY) if node in REPLAYED else (node,)
        return lambda session: self._is_of(nodes, session)

    def sessions(self, node: str) -> frozenset[str]:
        """Return the sessions of a node that are known by now."""
        self._begin()
        assert self._presence is not None, "it is watched"
        with self._lock:
            self._presence.poll()
            return self._presence.instances(node)

    def _begin(self) -> None:
        with self._lock:
            if self._presence is None:
                self._presence = self._watch()

    def _is_of(self, nodes: tuple[str, ...], session: str) -> bool:
        assert self._presence is not None, "it is watched before it is asked"
        with self._lock:
            self._presence.poll()
            return any(session in self._presence.instances(node) for node in nodes)
