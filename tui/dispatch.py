"""Sending of orders from background threads, so that a slow or missing service never freezes the console."""

from __future__ import annotations

import threading
from collections.abc import Callable

from touchline.tui.orders import WITHOUT_END, Order, OrderOutcome, Tried
from touchline.tui.protocol import CallFailed, Link
from touchline.tui.stop_sender import StopSender


class Dispatcher:
    """Sender with one short-lived thread per order: an emergency stop never queues behind a slow plan."""

    def __init__(self, link: Link, deliver: Callable[[Tried | OrderOutcome], object]) -> None:
        """Call `deliver` from the orders' threads for every try, and once with the outcome of an order."""
        self._link = link
        self._deliver = deliver
        self._stops = StopSender(link, deliver)

    def send(self, order: Order) -> None:
        """Send an order; an emergency stop repeatedly."""
        if order.attempts == WITHOUT_END:
            self._stops.send(order)
            return
        # A daemon, because leaving the console must not wait for an answer that may never come.
        threading.Thread(target=self._run, args=(order,), name=f"order-{order.name}", daemon=True).start()

    def post(self, order: Order) -> None:
        """Send an order once, from the calling thread."""
        self._link.post(order.service, order.request)

    def cease(self) -> None:
        """Stop repeating the emergency stop."""
        self._stops.cease()

    def _run(self, order: Order) -> None:
        self._deliver(self._ask(order))

    def _ask(self, order: Order) -> OrderOutcome:
        failure = ""
        for number in range(1, order.attempts + 1):
            if number > 1:
                self._deliver(Tried(order, number))
            try:
                return OrderOutcome(order, self._link.call(order.service, order.request, order.timeout_s))
            except CallFailed as error:
                failure = str(error)
        return OrderOutcome(order, failure=failure)
