"""Callers of services: on a secured bus the end of a request's key is the caller's name, held by access control."""

from typing import Final

_BY: Final = "@by"


def asked_key(key: str, caller: str) -> str:
    """Return the key of a request; on an open bus, where there are no identities, that of the service.

    Args:
        key: Key of the service.
        caller: Name of the caller's identity; "" on an open bus.
    """
    return f"{key}/{_BY}/{caller}" if caller else key


def served_key(key: str) -> str:
    """Return the key expression that a server of a service declares on a secured bus: whoever asks."""
    return asked_key(key, "*")


def caller_of(asked: str, key: str) -> str | None:
    """Return the name of a request's caller; None if it is not a request of one caller for this service.

    Args:
        asked: Key expression of the request.
        key: Key of the service.
    """
    prefix = f"{key}/{_BY}/"
    name = asked.removeprefix(prefix)
    return name if asked.startswith(prefix) and name and not set(name) & set("/*$") else None
