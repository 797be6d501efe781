"""Reads the diagnostics of services defensively: anybody on the bus may publish in their name."""

from dataclasses import dataclass

from touchline.schemas.messages import DiagnosticArray
from touchline.schemas.plain_text import plain

#: A counter with more digits is none.
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
    """What ``diagnostics`` say of ``node``."""
    status = next((status for status in diagnostics.status if status.name == node), None)
    if status is None:
        return Health("does not say how it is")
    values = {entry.key: entry.value for entry in status.values}
    counts = (_count(values.get(key, "")) for key in ("pid", "published", "received", "lost", "rejected"))
    return Health(plain(status.message, _LONGEST_MESSAGE), *counts)


def _count(text: str) -> int | None:
    return int(text) if text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS else None
