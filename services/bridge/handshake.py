"""Certainty about what another process knows and has heard."""

from collections.abc import Callable, Iterable

from schemas import topics
from schemas.errors import PayloadError
from schemas.messages import GetDiagnosticsRequest
from services.bus import Bus, CallError


def shake_hands(
    bus: Bus, nodes: Iterable[str], timeout_s: float, while_waiting: Callable[[], None] = lambda: None
) -> None:
    """Exchange one call with each of the nodes; those that are going down, or hang, are not waited for any longer.

    Declarations, messages and answers of one process keep their order. So when one has answered, it knew of our
    subscriptions before, and we of its; what either had sent until then has arrived.
    """
    for node in sorted(nodes):
        try:
            bus.call(topics.diagnostics_service(node), GetDiagnosticsRequest(), timeout_s, while_waiting)
        except (CallError, PayloadError):
            continue
