"""Late compilations: what a service compiles after it has reported that it is ready.

That is a defect, except for plug-ins and for vehicles that were not known at the start.
"""

from __future__ import annotations

import logging
import threading
import time
from contextlib import AbstractContextManager
from typing import Final

from touchline.core.compilations import Compilations
from touchline.supervision.shutdown import Stop

_LOG: Final = logging.getLogger(__name__)
KEY: Final = "late_compilations"
"""Key in the diagnostics."""


class LateCompilations:
    """List of late compilations from the first call of `watch`, in the service's loop, to the end of the process.

    Each is written to the log. One in the loop holds that up, so the heartbeat continues meanwhile: a process that is
    killed while it compiles has to compile the same again.

    Args:
        stop: Stop flag of the service.

    Attributes:
        current: The function being compiled; "" if none is.
    """

    def __init__(self, stop: Stop) -> None:
        self.current = ""
        self._stop, self._loop = stop, 0
        self._compilations = Compilations(self._begin, self._end)
        self._begun_s = 0.0
        self._beating: AbstractContextManager[None] | None = None

    def watch(self) -> None:
        """Start watching, as the service is ready; further calls do nothing."""
        if not self._loop:
            self._loop = threading.get_ident()
            self._compilations.__enter__()

    def values(self) -> dict[str, object]:
        """Return their names as values of the diagnostics; empty if there was none."""
        return {KEY: ", ".join(self._compilations.names)} if self._compilations.names else {}

    def _begin(self, name: str) -> None:
        if self.current:  # one that the current one needs
            return
        self.current, self._begun_s = name, time.monotonic()
        if threading.get_ident() == self._loop:
            self._beating = self._stop.beating()
            self._beating.__enter__()

    def _end(self, name: str) -> None:
        if name != self.current:
            return
        thread, took_s = threading.current_thread().name, time.monotonic() - self._begun_s
        if self._beating is not None:
            self._beating.__exit__(None, None, None)
        self.current, self._beating = "", None
        _LOG.warning("%s was compiled after the start, in %.1f s by %s", name, took_s, thread)
