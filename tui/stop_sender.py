"""Repetition of an emergency stop until the robot has acknowledged it, by the bus and at the robot's own door."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from touchline.tui.orders import Order, OrderOutcome, Tried
from touchline.tui.protocol import CallFailed, Link

EVERY_S = 0.5
"""Period of the tries."""
SAME_PRESS_S = 0.1
"""Age up to which a try serves another press of the key, too, so that a key that is held down costs nothing."""


@dataclass
class _Stop:
    order: Order
    tries: int = 0
    tried_s: float = 0.0
    called_off: threading.Event = field(default_factory=threading.Event)


class StopSender:
    """Sender with a thread per try, so that a pending answer never delays the next try."""

    def __init__(self, link: Link, deliver: Callable[[Tried | OrderOutcome], object]) -> None:
        """Call `deliver` from the tries' threads."""
        self._link, self._deliver = link, deliver
        self._lock = threading.Lock()
        self._stop: _Stop | None = None

    def send(self, order: Order) -> None:
        """Send a stop at once and repeatedly; one with another request id replaces the last."""
        with self._lock:
            stop = self._stop
            if stop is None or stop.order.request_id != order.request_id:
                if stop is not None:
                    stop.called_off.set()
                stop = self._stop = _Stop(order, tried_s=time.monotonic())
                # From here, as the machine may be so busy that handing over to another thread takes long.
                self._link.post(order.service, order.request)
                # A daemon, because leaving the console must not wait for an answer that may never come.
                threading.Thread(target=self._repeat, args=(stop,), name="estop", daemon=True).start()
                return
            if time.monotonic() - stop.tried_s < SAME_PRESS_S:
                return
        threading.Thread(target=self._try, args=(stop,), name="estop-again", daemon=True).start()

    def cease(self) -> None:
        """Stop repeating, as the robot has the stop or the operator withdrew it."""
        with self._lock:
            if self._stop is not None:
                self._stop.called_off.set()
                self._stop = None

    def _repeat(self, stop: _Stop) -> None:
        """Send at least once: the reason for calling it off may be older than the key press."""
        order = (stop.order.service, stop.order.request, stop.called_off)
        at_door = threading.Thread(target=self._link.repeat_at_door, args=order, name="estop-door", daemon=True)
        while True:
            due_s = time.monotonic() + EVERY_S
            self._try(stop)
            if stop.called_off.wait(max(due_s - time.monotonic(), 0.0)):
                return
            if at_door.ident is None:  # not in vain: whoever carries the bus may hang while the robot goes on
                at_door.start()

    def _try(self, stop: _Stop) -> None:
        with self._lock:
            stop.tries += 1
            stop.tried_s = time.monotonic()
            tries = stop.tries
        order = stop.order
        self._deliver(Tried(order, tries))
        try:
            outcome = OrderOutcome(order, self._link.call(order.service, order.request, order.timeout_s))
        except CallFailed as error:
            outcome = OrderOutcome(order, failure=str(error))
        self._deliver(outcome)
