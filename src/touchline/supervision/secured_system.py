"""Identities of the processes of a secured system on this machine."""

import logging
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Final

from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role
from touchline.schemas.user_folders import keys_folder
from touchline.security.identity import Identity
from touchline.supervision.repeated import repeated

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


def renewed(namespaces: Sequence[str]) -> AbstractContextManager[None]:
    """Renew in the background what expires soon: links are opened anew with it when the router takes it over."""

    def renew() -> None:
        try:
            system_identities(namespaces)
        except TouchlineError as error:
            _LOG.error("certificates cannot be renewed: %s", error)

    return repeated(renew, _RENEWED_EVERY_S, "renew")
