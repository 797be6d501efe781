"""Router of a bus that spans several machines or is secured: every process is its client."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import zenoh

from touchline.bus.config import BusConfig
from touchline.bus.joining import leave, listen
from touchline.bus.presence import ROUTER_TOKEN
from touchline.bus.refusal_watch import watch_refusals
from touchline.bus.remote_access import check_exposure, endpoints
from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role
from touchline.schemas.user_folders import audit_folder
from touchline.security.audit_log import AuditLog

_LOG = logging.getLogger(__name__)


@contextmanager
def open_router(config: BusConfig) -> Iterator[tuple[str, Callable[[], None]]]:
    """Route at the meeting point of a bus until the context is left.

    Yields:
        Where it listens, and a function to be called now and then: it opens a secured router's session anew when
        its certificate or the access list have changed, which interrupts all links for a fifth of a second.

    Raises:
        SpecError: The configuration cannot be used.
        TouchlineError: It cannot listen there.
    """
    settings = config.router()
    routing: list[_Routing] = []
    if config.identity is None:
        check_exposure(settings)
    else:
        audit = AuditLog(audit_folder(), Role.ROUTER, "")
        watch_refusals(audit, lambda: ", ".join(routing[0].linked()) if routing else "nobody")
    routing.append(_Routing(settings))
    renewals = config.renewals() if config.identity is not None else None

    def look() -> None:
        nonlocal renewals
        if renewals is None:
            return
        try:
            if (renewed := next(renewals)) is not None:
                again = renewed.router()
                routing.pop().close()
                routing.append(_Routing(again))
                _LOG.info("certificate or access list have changed: all links were opened anew")
        except TouchlineError as error:
            if not routing:
                raise
            _LOG.error("the old access list stays in force: %s", error)
            renewals = config.renewals()

    try:
        yield ", ".join(endpoints(settings, "listen")), look
    finally:
        for each in routing:
            each.close()


class _Routing:
    """Session of a router, and its token."""

    def __init__(self, settings: zenoh.Config) -> None:
        self._session = listen(settings, "the router")
        self._token = self._session.liveliness().declare_token(ROUTER_TOKEN)

    def linked(self) -> list[str]:
        return sorted({link.auth_identifier or "?" for link in self._session.info.links()})

    def close(self) -> None:
        leave(self._session)
