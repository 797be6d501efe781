"""Preparation of loads in a thread of their own: reading a large plan takes seconds, and the loop turns meanwhile."""

from __future__ import annotations

import logging
import queue
import threading
from typing import Any, Final, NamedTuple

from touchline.bus import ServedCall
from touchline.schemas.errors import CommandRefused, PayloadError, SpecError
from touchline.services.robot_sim.command_handlers import Load

_LOG: Final = logging.getLogger(__name__)
WAITING: Final = 2
"""Number of loads that may wait for the one in preparation; further ones are refused for now."""


class Prepared(NamedTuple):
    """A request that is ready to be carried out, or the reason why it cannot be."""

    call: ServedCall[Any, Any]
    load: Load
    ready: Any


class Loader:
    """Thread that prepares one load after another.

    The thread never touches the robot or the bus: the loop takes its results.
    """

    def __init__(self) -> None:
        self._asked: queue.SimpleQueue[tuple[ServedCall[Any, Any], Load]] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Prepared] = queue.SimpleQueue()
        self._under_way = 0
        self._thread: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """True if another load has to be sent again later."""
        return self._under_way > WAITING

    @property
    def idle(self) -> bool:
        """True if nothing is being prepared."""
        return self._under_way == 0

    def prepare(self, call: ServedCall[Any, Any], load: Load) -> None:
        """Begin to prepare a request by the handler of its service, after those before it."""
        self._under_way += 1
        self._asked.put((call, load))
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="loading", daemon=True)
            self._thread.start()

    def poll(self) -> Prepared | None:
        """Return the next request that is ready, if there is one."""
        if self._done.empty():
            return None
        self._under_way -= 1
        return self._done.get()

    def _work(self) -> None:
        while True:
            call, load = self._asked.get()
            self._done.put(Prepared(call, load, _made_ready(call, load)))


def _made_ready(call: ServedCall[Any, Any], load: Load) -> Any:
    """Return the result; None for an unforeseen error, which is written to the log and must not end the robot."""
    try:
        return load.prepare(call.request)
    except (PayloadError, CommandRefused, SpecError) as error:
        return error
    except Exception:  # noqa: BLE001, a defect in reading must not end a robot
        _LOG.exception("a plan cannot be read")
        return None
