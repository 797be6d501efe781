"""Origins of web pages that may connect as viewers."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final
from urllib.parse import urlsplit

from touchline.schemas.loopback import is_loopback_host

KNOWN_ORIGINS: Final = ("https://app.foxglove.dev", "file://")
"""Foxglove in a browser; desktop applications (Foxglove, Lichtblick) and pages in files of this machine."""
_ORIGIN: Final = re.compile(r"[a-z][a-z0-9+.-]*://[a-z0-9.:_\[\]-]*", re.ASCII)


def is_origin(text: str) -> bool:
    """Return whether a text is an origin as browsers send it: ``https://viewer.example:8080``."""
    return bool(_ORIGIN.fullmatch(text.lower()))


def is_allowed(origin: str, origins: Collection[str]) -> bool:
    """Return whether pages of an origin may connect: known viewers, pages that this machine serves, and named ones.

    ``null``, which pages in a sandbox send whoever made them, is none of these.

    Args:
        origin: As the browser sends it.
        origins: Named by the user.
    """
    given = origin.lower()
    if given in KNOWN_ORIGINS or given in {each.lower() for each in origins}:
        return True
    return is_origin(given) and given.startswith(("http://", "https://")) and _is_loopback(given)


def _is_loopback(origin: str) -> bool:
    try:
        return is_loopback_host(urlsplit(origin).hostname or "")
    except ValueError:
        return False
