"""Versions and platform that made a recording, on which the last bits of figures may depend."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from touchline.core.kernel_store import numba_version
from touchline.recordings.code_identity import code_digest, commit, own_version
from touchline.schemas.plugin_packages import installed

MADE_BY: Final = "touchline_made_by"
"""Name of the metadata record."""
_PACKAGES: Final = ("numpy", "scipy", "shapely", "eclipse-zenoh", "mcap")
_PLUGIN: Final = "plugin "
"""Prefix of the keys of packages that offer plug-ins."""
DECIDES: Final = ("numpy", "numba", "machine", "system", "libc")
"""If one of these differs, bits may differ."""


def made_by() -> dict[str, str]:
    """Return those of this process; packages that are not installed are left out."""
    own = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "system": platform.system(),
        "libc": " ".join(platform.libc_ver()).strip(),
    }
    code = {"touchline": own_version(), "commit": commit(), "code": code_digest()}
    plugins = {f"{_PLUGIN}{name}": number for name, number in installed().items()}
    packages = {name: _version(name) for name in _PACKAGES} | {"numba": numba_version()}
    return {name: number for name, number in packages.items() if number} | code | own | plugins


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def other_code(then: Mapping[str, str]) -> str:
    """Return the version and commit of a recording made by other code than this; empty if it was made by the same."""
    if then.get("code") == code_digest():
        return ""
    made = then.get("commit", "")
    return f"Touchline {then.get('touchline', 'of an unknown version')}{f' ({made[:12]})' if made else ''}"


def other_plugins(then: Mapping[str, str]) -> list[str]:
    """Return plug-in packages of a recording that are not installed here in that version."""
    here = installed()
    found = []
    for key, number in then.items():
        name = key.removeprefix(_PLUGIN)
        if name != key and here.get(name) != number:
            found.append(f"{name} {number} ({f'here {here[name]}' if name in here else 'not installed here'})")
    return found


def other_platform(then: Mapping[str, str]) -> list[str]:
    """Return parts of the platform that decide on the last bits and differ here; all if they are not recorded."""
    now = made_by()
    differing = [name for name in DECIDES if then.get(name) != now.get(name)]
    return [f"{name} ({then.get(name, 'unknown')}, here {now.get(name, 'none')})" for name in differing]
