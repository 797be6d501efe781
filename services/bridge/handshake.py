"""Flush barrier with other processes: after it, subscriptions are known and earlier messages have arrived."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial

from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import GetDiagnosticsRequest
from touchline.services.bus import Bus, CallError
from touchline.services.bus.presence import Presence


class _Gone(Exception):
    """The node has left the bus."""


def shake_hands(
    bus: Bus,
    presence: Presence,
    nodes: Iterable[str],
    timeout_s: float,
    while_waiting: Callable[[], None] = lambda: None,
) -> bool:
    """Exchange one call with each of the nodes on the bus; one that hangs is given up after ``timeout_s``.

    Returns whether each has answered, but for those that have left.

    Declarations, messages and answers of one process keep their order. So when one has answered, it knew of our
    subscriptions before, and we of its; what either had sent until then has arrived.
    """

    def wait(node: str) -> None:
        presence.poll()
        if node not in presence.alive():
            raise _Gone
        while_waiting()

    answered = True
    for node in sorted(nodes):
        with suppress(PayloadError, _Gone):
            wait(node)
            try:
                bus.call(topics.diagnostics_service(node), GetDiagnosticsRequest(), timeout_s, partial(wait, node))
            except CallError:
                answered = False
    return answered
