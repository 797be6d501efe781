"""Shutdown of a service process on a signal or when its supervisor is gone; also beats its heartbeat."""

import logging
import os
import signal
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType

from touchline.supervision.heartbeat import Heartbeat
from touchline.supervision.repeated import repeated
from touchline.supervision.service_manager import ServiceManager

_LOG = logging.getLogger(__name__)
ENDS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
#: Longest work within a turn; more counts as a hang.
WORK_S = 60.0
_BEAT_EVERY_S = 0.1


class Stop:
    """Flag that is true once this process has been asked to end; evaluating it also beats the heartbeat."""

    def __init__(
        self, supervisor: int | None, heartbeat: Heartbeat | None = None, manager: ServiceManager | None = None
    ) -> None:
        """Start without a signal; `supervisor` is the parent's process id, if this process must not outlive it.

        The parent passes it: by the time that this process looks for it, it may be gone, and another in its place.
        """
        self._signalled = False
        self._parent = supervisor
        self._watchers = [watcher for watcher in (heartbeat, manager) if watcher is not None]
        self._ready = False

    def signal(self, _number: int, _frame: FrameType | None) -> None:
        """Note a signal; the main loop sees it at its next turn."""
        self._signalled = True

    def beat(self) -> None:
        """Beat the heartbeat during long waits within a turn of the loop; the first time the service is ready."""
        if not self._ready:
            self._ready = True
            _LOG.info("ready")
        for watcher in self._watchers:
            watcher.beat()

    def beating(self) -> AbstractContextManager[None]:
        """Beat from another thread during known long work of this one, but no longer than `WORK_S`."""
        last_s = time.monotonic() + WORK_S

        def beat() -> None:
            if time.monotonic() < last_s:
                self.beat()

        return repeated(beat, _BEAT_EVERY_S, "heartbeat")

    @property
    def asked(self) -> bool:
        """True if the process is to end, without beating the heartbeat: for use before the loop begins."""
        return self._signalled or (self._parent is not None and os.getppid() != self._parent)

    def __bool__(self) -> bool:
        """Return whether to end now."""
        self.beat()
        return self.asked


@contextmanager
def until_stopped(supervisor: int | None = None) -> Iterator[Stop]:
    """Turn SIGTERM, SIGINT and a hang-up into a flag, so that a service closes everything it has open.

    The flag is also set when `supervisor`, a process id, is no longer the parent.
    """
    manager = ServiceManager.from_environment()
    stop = Stop(supervisor, Heartbeat.from_environment(), None) if supervisor is not None else Stop(None, None, manager)
    wanted = [number for number in ENDS if signal.getsignal(number) is not signal.SIG_IGN]
    previous = {number: signal.signal(number, stop.signal) for number in wanted}
    try:
        yield stop
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        if manager is not None:
            manager.close()
