"""Who is there: liveliness tokens, which vanish within milliseconds when a process dies."""

from collections import defaultdict
from typing import NamedTuple

import zenoh
from zenoh import handlers


class Change(NamedTuple):
    """A process that came (``alive``) or went."""

    node: str
    instance: str
    alive: bool


class Presence:
    """The processes on the bus, kept up to date by :meth:`poll`."""

    def __init__(self, session: zenoh.Session, namespace: str) -> None:
        """Watch the tokens under ``namespace``; use :meth:`services.bus.Bus.presence`."""
        self._instances: defaultdict[str, set[str]] = defaultdict(set)
        key = f"{token_prefix(namespace)}/**"
        self._subscriber = session.liveliness().declare_subscriber(key, handlers.FifoChannel(1024), history=True)

    def poll(self) -> list[Change]:
        """What changed since the last call."""
        changes: list[Change] = []
        while (sample := self._subscriber.try_recv()) is not None:
            node, instance = str(sample.key_expr).rsplit("/", 2)[1:]
            alive = sample.kind == zenoh.SampleKind.PUT
            if alive != (instance in self._instances[node]):
                (self._instances[node].add if alive else self._instances[node].discard)(instance)
                changes.append(Change(node, instance, alive))
        return changes

    def alive(self) -> set[str]:
        """Names of the processes that are there, as of the last :meth:`poll`."""
        return {node for node, instances in self._instances.items() if instances}


def token_prefix(namespace: str) -> str:
    """Where the liveliness tokens are; ``@`` keeps them out of every ``**``."""
    return f"@touchline/{namespace}"
