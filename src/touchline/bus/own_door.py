"""A robot's own door on a secured bus: a session of its own that can be joined while the router is away.

On an open bus every robot is a peer, and its door is one of its listeners (`touchline.bus.config`).
"""

import logging
import threading
from collections.abc import Callable
from typing import Final

import zenoh

from touchline.bus.config import BusConfig
from touchline.bus.joining import leave, listen
from touchline.schemas.errors import TouchlineError

_LOG: Final = logging.getLogger(__name__)
_LOOK_S: Final = 1.0
"""Time between two looks at certificate and access list."""


class OwnDoor:
    """Session at the door, opened anew when certificate or access list have changed.

    Args:
        config: Bus configuration with the robot's identity.
        declare: Declares in a session what is served at the door, and shows the robot's presence.

    Raises:
        TouchlineError: It cannot listen there.
    """

    def __init__(self, config: BusConfig, declare: Callable[[zenoh.Session], zenoh.LivelinessToken]) -> None:
        self._declare_all = declare
        self._lock, self._closed = threading.Lock(), threading.Event()
        self._open(config)
        threading.Thread(target=self._watch, args=(config,), name="own-door", daemon=True).start()

    def _open(self, config: BusConfig) -> None:
        self._session = listen(config.own_door(), "the robot's own door")
        self._token = self._declare_all(self._session)

    def declare(self, declare: Callable[[zenoh.Session], None]) -> None:
        """Declare something in the present session; later ones are declared anew as a whole."""
        with self._lock:
            declare(self._session)

    def _watch(self, config: BusConfig) -> None:
        renewals, due = config.renewals(), None
        while not self._closed.wait(_LOOK_S):
            try:
                due = next(renewals, None) or due
            except TouchlineError as error:
                _LOG.error("the robot's own door stays as it is: %s", error)
                renewals = config.renewals()
            try:
                if due is not None:
                    self._reopen(due)
                    due = None
            except TouchlineError as error:  # the port is free once the former session's links are gone
                _LOG.warning("%s; trying again", error)

    def _reopen(self, config: BusConfig) -> None:
        with self._lock:
            if not self._closed.is_set():
                leave(self._session)
                self._open(config)

    def close(self) -> None:
        """Stop listening."""
        self._closed.set()
        with self._lock:
            leave(self._session)
