"""Defensive reading of services' diagnostics: anybody on the bus may publish in their name."""

from dataclasses import dataclass

from touchline.schemas.messages import DiagnosticArray
from touchline.schemas.plain_text import plain

#: A counter with more digits is malformed.
_MOST_DIGITS = 18
_LONGEST_MESSAGE = 200


@dataclass(frozen=True)
class Health:
    """Health of a service; a counter that is missing or malformed is None."""

    message: str
    pid: int | None = None
    published: int | None = None
    received: int | None = None
    lost: int | None = None
    rejected: int | None = None


def read_health(node: str, diagnostics: DiagnosticArray) -> Health:
    """Return the health of ``node`` in ``diagnostics``."""
    status = next((status for status in diagnostics.status if status.name == node), None)
    if status is None:
        return Health("does not report its health")
    values = {entry.key: entry.value for entry in status.values}
    counts = (_count(values.get(key, "")) for key in ("pid", "published", "received", "lost", "rejected"))
    return Health(plain(status.message, _LONGEST_MESSAGE), *counts)


def _count(text: str) -> int | None:
    return int(text) if text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS else None
