"""Sender of answers from threads of their own, so that a slow client never blocks the server."""

import logging
import threading
from collections.abc import Callable
from contextlib import suppress
from enum import Enum, auto
from queue import Empty, Full, Queue
from typing import Final

import zenoh

_LOG: Final = logging.getLogger(__name__)
#: Most waiting answers in a lane; beyond them the oldest gives way, and its client gets an error.
_WAITING: Final = 1024
_CLOSING_S: Final = 1.0


class Lane(Enum):
    """Kind of an answer. Answers of one kind queue behind each other if a client is slow."""

    STOP = auto()
    """The first answer to a request that stops the robot."""
    FIRST = auto()
    """The first answer to any other request."""
    OTHER = auto()
    """Refusals and repeated answers, of which strangers may cause any number."""


class Replies:
    """Queue and thread for each lane in use."""

    def __init__(self) -> None:
        """Start without threads; they start when there is something to send."""
        self._lanes: dict[Lane, _Sender] = {}

    def send(self, lane: Lane, reply: Callable[[], None]) -> None:
        """Have `reply` called from the lane's thread. Never waits."""
        if lane not in self._lanes:
            self._lanes[lane] = _Sender(lane.name)
        self._lanes[lane].put(reply)

    def close(self) -> None:
        """Send what waits, within a time limit."""
        for sender in self._lanes.values():
            sender.close()


class _Sender:
    def __init__(self, name: str) -> None:
        self._waiting: Queue[Callable[[], None] | None] = Queue(_WAITING)
        self._thread = threading.Thread(target=self._work, name=f"replies-{name}", daemon=True)
        self._thread.start()

    def put(self, reply: Callable[[], None] | None) -> None:
        while True:
            try:
                self._waiting.put_nowait(reply)
                return
            except Full:
                with suppress(Empty):
                    self._waiting.get_nowait()

    def close(self) -> None:
        self.put(None)
        self._thread.join(_CLOSING_S)

    def _work(self) -> None:
        while (reply := self._waiting.get()) is not None:
            try:
                reply()
            except zenoh.ZError:
                continue  # the client has left
            except Exception:  # noqa: BLE001, the next client is to have its answer all the same
                _LOG.exception("an answer cannot be sent")
