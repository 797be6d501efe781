"""Heartbeat of a service's main loop: a time stamp in a small shared file that the supervisor watches.

Threads of Zenoh live on when the loop of a process hangs, so neither its liveliness token nor its open connections show
that anybody would answer an order.

On a busy machine a sound loop pauses for a while, too. So time in which its process waits for a processor does not
count:
a loop hangs that has not turned though it had one, or wanted none. The processor time of its own thread counts: on a
busy machine Zenoh's threads have some, too. Only while it waits for them does theirs count.
"""

import mmap
import os
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from touchline.supervision.processor_use import ProcessorUse

#: Environment variable with the file's name; a service that runs alone has none, and no cost.
VARIABLE: Final = "TOUCHLINE_HEARTBEAT"
#: Time without a turn after which a loop hangs: the longest turn of a sound one takes some tenths of a second.
HANGS_S: Final = 1.0
#: Time without a turn after which the process is looked at: that takes a while, and most loops turn sooner.
_SUSPICIOUS_S: Final = 0.2
_BEAT: Final = struct.Struct("=Q")
#: Most time that counts between two looks: a supervisor that was held up knows nothing of the time between.
_LOOK_S: Final = 0.25


class Heartbeat:
    """Heartbeat as written by the service."""

    def __init__(self, path: Path) -> None:
        """Map the file that the supervisor has made."""
        self._value = memoryview(_mapped(path)).cast("Q")

    @classmethod
    def from_environment(cls) -> "Heartbeat | None":
        """Return that of this process, if its supervisor gave it one; child processes do not inherit it."""
        path = os.environ.pop(VARIABLE, None)
        return cls(Path(path)) if path else None

    def beat(self) -> None:
        """Show that the loop turns; takes less than a microsecond."""
        # In one piece: `pack_into` writes zeros first, and stopped there, a process seemed never to have begun.
        self._value[0] = time.monotonic_ns()


class HeartbeatWatch:
    """Heartbeat as read by the supervisor.

    Attributes:
        path: The file, for the environment of the child.
        begun: Whether there was a beat; before the first one, a service compiles its kernels.
        quiet_s: Time without a beat since, less the time in which the process waited for a processor.
    """

    def __init__(self, path: Path) -> None:
        """Create the file anew, readable by nobody else."""
        self.path = path
        path.unlink(missing_ok=True)
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        try:
            os.ftruncate(file, _BEAT.size)
        finally:
            os.close(file)
        self._map = _mapped(path)
        self.begun = False
        self.quiet_s = 0.0
        self._last = 0
        self._looked_s: float | None = None
        self._before: ProcessorUse | None = None

    def look(self, now_s: float, use: Callable[[], ProcessorUse | None]) -> None:
        """Read the beat.

        Args:
            now_s: Monotonic time.
            use: Returns the process's processor use; called only after some time without a beat.
        """
        (value,) = _BEAT.unpack_from(self._map, 0)
        if value != self._last:
            self._last, self.begun, self.quiet_s, self._before = value, True, 0.0, None
        elif self.begun and self._looked_s is not None:
            passed_s = min(now_s - self._looked_s, _LOOK_S)
            self.quiet_s += passed_s if self.quiet_s < _SUSPICIOUS_S else self._counted_s(passed_s, use())
        self._looked_s = now_s

    def _counted_s(self, passed_s: float, doing: ProcessorUse | None) -> float:
        """Return how much of a time without a turn of the loop counts."""
        before, self._before = self._before, doing
        if doing is None or not (doing.loop_wants or doing.others_want):
            return passed_s
        if before is None:
            return 0.0
        had_s = doing.loop_s - before.loop_s if doing.loop_wants else doing.all_s - before.all_s
        return min(passed_s, had_s)


def _mapped(path: Path) -> mmap.mmap:
    file = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        return mmap.mmap(file, _BEAT.size)
    finally:
        os.close(file)
