"""Identities of the processes of a secured system on this machine."""

import logging
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final

from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role
from touchline.schemas.user_folders import keys_folder
from touchline.security.identity import Identity

_LOG: Final = logging.getLogger(__name__)
_RENEWED_EVERY_S: Final = 60.0

Identities = Mapping[Role | str, Identity]


def system_identities(namespaces: Sequence[str]) -> Identities:
    """Return the identities of a system on this machine, from the user's folder of keys; missing ones are issued.

    Args:
        namespaces: Of the robots.

    Raises:
        SpecError: They cannot be made or used.
        MissingExtra: The package cryptography is not installed.
    """
    from touchline.security.authority import issued_for_system

    return issued_for_system(keys_folder(), namespaces)


@contextmanager
def renewed(namespaces: Sequence[str]) -> Iterator[None]:
    """Renew in the background what expires soon: links are opened anew with it when the router takes it over."""
    done = threading.Event()

    def work() -> None:
        while not done.wait(_RENEWED_EVERY_S):
            try:
                system_identities(namespaces)
            except TouchlineError as error:
                _LOG.error("certificates cannot be renewed: %s", error)

    thread = threading.Thread(target=work, name="renew", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
