"""Proof of what has reached whom: a wait of fixed length proves nothing on a busy machine."""

import time
from collections.abc import Callable

from touchline.bus import Bus, CallError
from touchline.schemas import messages as m
from touchline.schemas.topics import Service

_PROBE = Service("test/caught_up", m.CommandRequest, m.CommandResponse, "")


_LONGEST_LOOK_S = 0.5


def eventually(condition: Callable[[], bool], timeout_s: float = 60.0) -> bool:
    """Return whether something happens in time; time in which this process itself was held up does not count."""
    waited_s, looked_s = 0.0, time.monotonic()
    while not condition():
        if waited_s > timeout_s:
            return False
        time.sleep(0.005)
        waited_s, looked_s = waited_s + min(time.monotonic() - looked_s, _LONGEST_LOOK_S), time.monotonic()
    return True


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
