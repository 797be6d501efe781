"""Sends orders from background threads, so that a slow or missing service never freezes the console."""

from __future__ import annotations

import threading
from collections.abc import Callable

from touchline.tui.orders import WITHOUT_END, Order, OrderOutcome, Tried
from touchline.tui.protocol import CallFailed, Link
from touchline.tui.stop_sender import StopSender


class Dispatcher:
    """One short-lived thread an order: an emergency stop never queues behind a plan that takes its time."""

    def __init__(self, link: Link, deliver: Callable[[Tried | OrderOutcome], object]) -> None:
        """`deliver` is called from the orders' threads: for every try, and once with what came of an order."""
        self._link = link
        self._deliver = deliver
        self._stops = StopSender(link, deliver)

    def send(self, order: Order) -> None:
        """Send it; an emergency stop again and again."""
        if order.attempts == WITHOUT_END:
            self._stops.send(order)
            return
        # A daemon, because leaving the console must not wait for an answer that may never come.
        threading.Thread(target=self._run, args=(order,), name=f"order-{order.name}", daemon=True).start()

    def tell(self, order: Order) -> None:
        """Send it once, at once."""
        self._link.tell(order.service, order.request)

    def cease(self) -> None:
        """Call the emergency stop off."""
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
