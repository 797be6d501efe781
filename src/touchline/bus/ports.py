"""Free ports for private buses."""

import random
import socket
from typing import Final

_PORTS: Final = range(20_000, 32_768)
"""Below those that Linux assigns by itself, which may be taken before a process comes to listen."""
_CHANCE: Final = random.SystemRandom()


def free_port() -> int:
    """Return a free loopback port whose successor is free, too: that one becomes the robot's own door."""
    while True:
        port = _CHANCE.choice(_PORTS[::2])
        if _is_free(port) and _is_free(port + 1):
            return port


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True
