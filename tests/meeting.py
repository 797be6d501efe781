"""Where processes meet, and proof of what has reached whom: a wait of fixed length proves nothing on a busy machine."""

import random
import socket
import time

from schemas import messages as m
from schemas.topics import Service
from services.bus import Bus, CallError

#: Below those that Linux hands out by itself.
_PORTS = range(20_000, 32_768)
_CHANCE = random.SystemRandom()
_PROBE = Service("test/caught_up", m.CommandRequest, m.CommandResponse)


def free_port() -> int:
    """A port of loopback that nobody listens on.

    None of those that the system hands out: one of these may be somebody's before the test comes to use it.
    """
    while True:
        port = _CHANCE.choice(_PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port


def caught_up(here: Bus, there: Bus, timeout_s: float = 60.0) -> None:
    """Wait until all that ``there`` has declared and sent so far has reached ``here``.

    Declarations, messages and answers of one process keep their order, so its answer comes after them. Both ends have
    to be in this process.
    """
    server, deadline = there.serve(_PROBE), time.monotonic() + timeout_s

    def answer() -> None:
        while (call := server.poll()) is not None:
            call.reply(m.CommandResponse(success=True))

    while True:
        try:
            here.call(_PROBE, m.CommandRequest(), timeout_s, answer)
        except CallError:  # they have not met yet
            assert time.monotonic() < deadline, f"{here.node} and {there.node} do not meet"
        else:
            return
