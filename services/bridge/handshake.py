"""Flush barrier with other processes: after it, subscriptions are known and earlier messages have arrived."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from typing import NamedTuple

from touchline.bus import Bus, CallError
from touchline.bus.presence import Presence
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import DiagnosticArray, GetDiagnosticsRequest


class Handshake(NamedTuple):
    """Result of a handshake.

    Attributes:
        answers: Diagnostics by node, of each that has answered.
        silent: Nodes that are on the bus and have not answered; those that have left are in neither.
    """

    answers: dict[str, DiagnosticArray]
    silent: frozenset[str]


class _Gone(Exception):
    """The node has left the bus."""


def shake_hands(
    bus: Bus,
    presence: Presence,
    nodes: Iterable[str],
    timeout_s: float,
    while_waiting: Callable[[], None] = lambda: None,
) -> Handshake:
    """Exchange one call with each of the nodes on the bus; a silent one is skipped after ``timeout_s``.

    Declarations, messages and answers of one process keep their order. So when one has answered, it knew of our
    subscriptions before, and we of its; what either had sent until then has arrived.

    Args:
        bus: The bus.
        presence: Presence of the processes on it.
        nodes: Names of the nodes to call.
        timeout_s: Wall-clock time for all answers.
        while_waiting: Called often.
    """

    def wait(node: str) -> None:
        presence.poll()
        if node not in presence.alive():
            raise _Gone
        while_waiting()

    answers: dict[str, DiagnosticArray] = {}
    silent: set[str] = set()
    request = GetDiagnosticsRequest()
    for node in sorted(nodes):
        with suppress(PayloadError, _Gone):
            wait(node)
            try:
                response = bus.call(topics.diagnostics_service(node), request, timeout_s, partial(wait, node))
                answers[node] = response.diagnostics
            except CallError:
                silent.add(node)
    return Handshake(answers, frozenset(silent))
