"""Gate before the services of a process: who may ask for what, and the audit log of what was ordered."""

from __future__ import annotations

from typing import Any, Final

from touchline.bus.caller import caller_of, served_key
from touchline.bus.config import BusConfig
from touchline.schemas.roles import Role
from touchline.schemas.topics import ANYBODY, Service
from touchline.security.audit_log import AuditLog, audit_folder

REFUSED: Final = "refused: "
"""Beginning of the reason for which a caller's role does not admit a request."""


class Gate:
    """Gate of one robot's services in a process.

    Args:
        audit: Log of orders on a secured bus; None on an open one, where nobody knows who asks.
    """

    def __init__(self, audit: AuditLog | None = None) -> None:
        self._audit = audit

    @classmethod
    def of(cls, node: str, config: BusConfig) -> Gate:
        """Return the gate of a process.

        Args:
            node: Name of the process.
            config: Its bus configuration.
        """
        if config.identity is None:
            return cls()
        return cls(AuditLog(audit_folder(), node, config.namespace))

    def close(self) -> None:
        """Write what waits for the audit log."""
        if self._audit is not None:
            self._audit.close()

    def served_key(self, key: str) -> str:
        """Return the key expression that a server declares.

        Args:
            key: Key of the service.
        """
        return key if self._audit is None else served_key(key)

    def caller(self, asked: str, key: str) -> str | None:
        """Return who asks, "" on an open bus; None if the request is not by the service's own key.

        Args:
            asked: Key expression of the request.
            key: Key of the service.
        """
        return caller_of(asked, key) if self._audit is not None else "" if asked == key else None

    def problem(self, caller: str, service: Service[Any, Any]) -> str:
        """Return why a caller may not ask for this; "" if it may."""
        if self._audit is None or caller.partition(".")[0] in service.callers:
            return ""
        need = ", ".join(sorted(role for role in service.callers if role in Role))
        return f"{REFUSED}{caller} may not ask for {service.name}; that takes the role {need}"

    def notes(self, service: Service[Any, Any]) -> bool:
        """Return whether requests are noted: what anybody may ask for changes nothing."""
        return self._audit is not None and service.callers != ANYBODY

    def note(self, caller: str, service: Service[Any, Any], answer: str, text: str) -> None:
        """Write an order and its answer to the audit log, if there is one and the service is noted.

        Args:
            caller: Who has asked.
            service: For what.
            answer: ``accepted``, ``refused`` or ``error``.
            text: The answer's message.
        """
        if self._audit is not None and self.notes(service):
            self._audit.note(caller, service.name, answer, text)
