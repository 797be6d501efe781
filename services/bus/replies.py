"""Answers on their way: sent by threads, so that who serves never waits for a client to take them."""

import threading
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, Full, Queue
from typing import Final

import zenoh

#: Answers that wait at most; beyond them the oldest gives way, and its client is told that there is none.
_WAITING: Final = 1024
_CLOSING_S: Final = 1.0


class Replies:
    """Two lanes, so that answers given anew for repeats of a request never hold up the first ones."""

    def __init__(self) -> None:
        """No thread is started before there is something to send."""
        self._first, self._again = _Lane("replies"), _Lane("replies-again")

    def send(self, reply: Callable[[], None], *, again: bool = False) -> None:
        """Have `reply` called, from another thread; `again` if it repeats an answer. Never waits."""
        (self._again if again else self._first).put(reply)

    def close(self) -> None:
        """Have sent what waits, as far as that does not take long."""
        for lane in (self._first, self._again):
            lane.close()


class _Lane:
    """A queue and the thread that empties it."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._waiting: Queue[Callable[[], None] | None] = Queue(_WAITING)
        self._thread: threading.Thread | None = None

    def put(self, reply: Callable[[], None] | None) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
            self._thread.start()
        while True:
            try:
                self._waiting.put_nowait(reply)
                return
            except Full:
                with suppress(Empty):
                    self._waiting.get_nowait()

    def close(self) -> None:
        if self._thread is not None:
            self.put(None)
            self._thread.join(_CLOSING_S)

    def _work(self) -> None:
        while (reply := self._waiting.get()) is not None:
            with suppress(zenoh.ZError):  # the client has left
                reply()
