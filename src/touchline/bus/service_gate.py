"""ServiceGate before the services of a process: who may ask for what, and the audit log of what was ordered."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

from touchline.bus.caller import caller_of, served_key
from touchline.bus.config import BusConfig
from touchline.schemas.roles import Role
from touchline.schemas.topics import ANYBODY, Service
from touchline.schemas.user_folders import audit_folder
from touchline.security.audit_log import AuditLog, OrderAnswer

REFUSED: Final = "refused: "
"""Beginning of the reason for which a caller's role does not admit a request."""


class ServiceGate:
    """ServiceGate of one robot's services in a process. On an open bus it is open: nobody knows who asks.

    Args:
        node: Name of the process.
        config: Its bus configuration.
    """

    def __init__(self, node: str, config: BusConfig) -> None:
        self._node, self._namespace = node, config.namespace
        self._secured = config.identity is not None

    @cached_property
    def _audit(self) -> AuditLog:
        return AuditLog(audit_folder(), self._node, self._namespace)

    def close(self) -> None:
        """Write what waits for the audit log."""
        if "_audit" in vars(self):
            self._audit.close()

    def served_key(self, key: str) -> str:
        """Return the key expression that a server declares.

        Args:
            key: Key of the service.
        """
        return served_key(key) if self._secured else key

    def caller(self, asked: str, key: str) -> str | None:
        """Return who asks, "" on an open bus; None if the request is not by the service's own key.

        Args:
            asked: Key expression of the request.
            key: Key of the service.
        """
        return caller_of(asked, key) if self._secured else "" if asked == key else None

    def problem(self, caller: str, service: Service[Any, Any]) -> str:
        """Return why a caller may not ask for this; "" if it may."""
        if not self._secured or caller.partition(".")[0] in service.callers:
            return ""
        need = ", ".join(sorted(role for role in service.callers if role in Role))
        return f"{REFUSED}{caller} may not ask for {service.name}; that takes the role {need}"

    def notes(self, service: Service[Any, Any]) -> bool:
        """Return whether requests are noted: what anybody may ask for, or robots alone, is no order."""
        return self._secured and service.callers not in (ANYBODY, {Role.ROBOT})

    def note(self, caller: str, service: Service[Any, Any], answer: OrderAnswer, text: str) -> None:
        """Write an order and its answer to the audit log, if the service is noted.

        Args:
            caller: Who has asked.
            service: For what.
            answer: The answer.
            text: Its message.
        """
        if self.notes(service):
            self._audit.note(caller, service.name, answer, text)
