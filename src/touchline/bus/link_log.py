"""Log of a secured process's link to its router: when it is lost and why, and when it is there again."""

import logging
import threading
from collections.abc import Callable
from typing import Final

from touchline.bus.config import BusConfig
from touchline.security.tls_check import why_refused

_LOG: Final = logging.getLogger(__name__)
_LOOK_S: Final = 1.0
"""Time between two looks; a router that takes over a new access list is back within one."""


class LinkLog:
    """Watches a link in a thread of its own, until it is closed.

    Args:
        config: Bus configuration with an identity.
        linked: Returns whether there is a link now.
    """

    def __init__(self, config: BusConfig, linked: Callable[[], bool]) -> None:
        self._config, self._linked = config, linked
        self._closed = threading.Event()
        threading.Thread(target=self._watch, name="link-log", daemon=True).start()

    def _watch(self) -> None:
        told, before = True, True
        while not self._closed.wait(_LOOK_S):
            now = self._linked()
            if now == before != told:
                told = now
                self._tell(told)
            before = now

    def _tell(self, linked: bool) -> None:
        if linked:
            _LOG.info("linked to the router again")
            return
        identity, endpoint = self._config.identity, self._config.endpoint
        reason = self._config.identity_problem()
        if not reason and endpoint.startswith("tls/"):
            reason = why_refused(endpoint, identity)
        _LOG.warning("no link to the router: %s", reason or f"{endpoint} does not answer")

    def close(self) -> None:
        """End the watch."""
        self._closed.set()
