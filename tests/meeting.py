"""Where processes meet."""

import os
import random
import socket

_EPHEMERAL_FROM = 32_768
_PORTS = range(20_000, _EPHEMERAL_FROM)
_PORT = random.Random(os.urandom(8))


def free_port() -> int:
    """A port of loopback that nobody listens on.

    None of those that the system hands out: one of these may be somebody's before the test comes to use it.
    """
    while True:
        port = _PORT.choice(_PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
