"""By what a recording was made: versions and the platform, on which the last bits of figures may depend."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Final

MADE_BY: Final = "touchline_made_by"
"""Name of the metadata record."""
_PACKAGES: Final = ("touchline", "numpy", "numba", "scipy", "shapely", "eclipse-zenoh", "mcap")
DECIDES: Final = ("numpy", "numba", "machine", "system", "libc")
"""Where one of these is another, bits may be."""


def made_by() -> dict[str, str]:
    """Of this process."""
    own = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "system": platform.system(),
        "libc": " ".join(platform.libc_ver()).strip(),
    }
    return {name: version(name) for name in _PACKAGES} | own
