"""Authenticates answers: only sessions with the liveliness token of the serving node may answer."""

import threading
from collections.abc import Callable

from touchline.services.bus.presence import Presence


class Answerers:
    """Sessions by node; thread-safe."""

    def __init__(self, watch: Callable[[], Presence]) -> None:
        """Watch presence from the first question on."""
        self._watch = watch
        self._presence: Presence | None = None
        self._lock = threading.Lock()

    def believed(self, node: str) -> Callable[[str], bool]:
        """Whether a session is one of ``node``; anybody is, where a service names no node."""
        if not node:
            return lambda session: True
        with self._lock:
            if self._presence is None:
                self._presence = self._watch()
        return lambda session: self._is_of(node, session)

    def _is_of(self, node: str, session: str) -> bool:
        assert self._presence is not None, "it is watched before it is asked"
        with self._lock:
            self._presence.poll()
            return session in self._presence.instances(node)
