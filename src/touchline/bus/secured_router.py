"""Router of a secured bus. Zenoh fixes certificate and access control when a session opens, so changes take a new one.

That interrupts all links for a fifth of a second, in which messages are lost. Whoever is revoked is out at once; all
other changes wait until no robot has driven for a while, or the certificate in use is about to expire.
"""

import logging
import math
import time
from datetime import UTC, datetime, timedelta
from typing import Final

import zenoh
from zenoh import handlers

from touchline.bus.config import BusConfig
from touchline.bus.joining import leave, listen
from touchline.bus.presence import ROUTER_TOKEN
from touchline.bus.refusal_watch import watch_refusals
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.roles import Role
from touchline.schemas.topics import STATUS
from touchline.schemas.traversal_state import traversal_state
from touchline.schemas.user_folders import audit_folder
from touchline.schemas.wellformed import Wellformed
from touchline.security.audit_log import AuditLog
from touchline.security.identity import Identity

_LOG: Final = logging.getLogger(__name__)
_LAST_MOMENT: Final = timedelta(minutes=1)
"""Remaining life of the certificate in use at which its successor no longer waits."""
_QUIET_S: Final = 10.0
"""Time after which no robot drives, and what it did has been recorded."""
_STATES: Final = 1024


class SecuredRouter:
    """Router at the endpoint of an access list.

    Args:
        config: Bus configuration with the router's identity.
        alone: As for `touchline.bus.router.open_router`.

    Raises:
        SpecError: The identity is not a router's.
        TouchlineError: It cannot listen there.
    """

    def __init__(self, config: BusConfig, *, alone: bool) -> None:
        self._renewals, self._config = config.renewals(), config
        self._next: BusConfig | None = None
        self._form, self._drove_s = Wellformed(STATUS.type), -math.inf
        self._session: zenoh.Session | None = None
        settings = config.router()
        if alone:
            watch_refusals(AuditLog(audit_folder(), Role.ROUTER, ""), self._linked)
        self._open(settings)
        self._waits_for_port = False

    def _open(self, settings: zenoh.Config) -> None:
        self._session = listen(settings, "the router")
        self._token = self._session.liveliness().declare_token(ROUTER_TOKEN)
        self._statuses = self._session.declare_subscriber(f"**/{STATUS.name}", handlers.RingChannel(_STATES))

    def _linked(self) -> str:
        try:
            links = self._session.info.links() if self._session is not None else []
        except zenoh.ZError:  # it is being opened anew
            links = []
        return ", ".join(sorted({link.auth_identifier or "?" for link in links})) or "nobody"

    def poll(self) -> None:
        """Take over a new certificate or access list, if it is time.

        While another program has the port, it is tried again.
        """
        while self._session is not None and (sample := self._statuses.try_recv()) is not None:
            payload = sample.payload.to_bytes()
            if not self._form.problem(payload) and traversal_state(payload) == TraversalStatus.RUNNING:
                self._drove_s = time.monotonic()
        try:
            self._next = next(self._renewals) or self._next
        except TouchlineError as error:
            _LOG.error("the access list in force stays so: %s", error)
            self._renewals = self._config.renewals()
        quiet = time.monotonic() - self._drove_s > _QUIET_S
        if self._next is not None and (quiet or self._session is None or self._urgent(self._next)):
            self._take_over(self._next)

    def _urgent(self, config: BusConfig) -> bool:
        present, new = _identity(self._config), _identity(config)
        removed = {member.name for member in present.access.members} - {member.name for member in new.access.members}
        return bool(removed) or present.expires - datetime.now(UTC) < _LAST_MOMENT

    def _take_over(self, config: BusConfig) -> None:
        settings = config.router()
        self.close()
        try:
            self._open(settings)
        except TouchlineError as error:
            if not self._waits_for_port:
                _LOG.error("%s; trying again", error)
            self._waits_for_port = True
            return
        self._waits_for_port = False
        self._config, self._next = config, None
        _LOG.info("certificate or access list have changed: all links were opened anew")

    def close(self) -> None:
        """Stop routing."""
        if self._session is not None:
            leave(self._session)
            self._session = None


def _identity(config: BusConfig) -> Identity:
    assert config.identity is not None, "checked by the configuration of a secured router"
    return config.identity
