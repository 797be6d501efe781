"""How a service process ends: on a signal, or when the supervisor that started it is gone."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Stop:
    """Whether this process has been asked to end."""

    def __init__(self, *, supervised: bool) -> None:
        """Note the parent, if it is a supervisor that this process must not outlive."""
        self._signalled = False
        self._parent = os.getppid() if supervised else None

    def signal(self, _number: int, _frame: FrameType | None) -> None:
        """Note a signal; the main loop sees it at its next turn."""
        self._signalled = True

    def __bool__(self) -> bool:
        """Whether to end now."""
        return self._signalled or (self._parent is not None and os.getppid() != self._parent)


@contextmanager
def until_stopped(*, supervised: bool = False) -> Iterator[Stop]:
    """Turn SIGTERM and SIGINT into a flag, so that a service closes everything it has open."""
    stop = Stop(supervised=supervised)
    previous = {number: signal.signal(number, stop.signal) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield stop
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
