"""Folders of the user, by the XDG base directory specification."""

import os
from pathlib import Path


def state_folder() -> Path:
    """Return the folder of what lasts, such as journals and logs: ``$XDG_STATE_HOME/touchline``."""
    base = os.environ.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local" / "state") / "touchline"


def audit_folder() -> Path:
    """Return the folder of audit logs."""
    return state_folder() / "audit"


def keys_folder() -> Path:
    """Return the default folder of keys: ``$XDG_CONFIG_HOME/touchline/keys``."""
    base = os.environ.get("XDG_CONFIG_HOME")
    return (Path(base) if base else Path.home() / ".config") / "touchline" / "keys"
