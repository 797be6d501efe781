"""Metadata and attachments of a recording beside its messages: causes, orders and session hashes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import RobotOrder, String, TraversalReport

SESSIONS: Final = "touchline_sessions"
"""Name of the metadata record: the session hashes of each robot's traversals, in their order."""
_TEXTS: Final = {topics.SETUP.name: "setup.json", topics.TEMPLATE.name: "template.json"}
KEPT: Final = frozenset((*_TEXTS, topics.ORDERS.name, topics.REPORT.name))
"""Names of the collected topics."""
_MOST_ORDERS: Final = 10_000


class AttachedFile(NamedTuple):
    """File attached to a recording."""

    name: str
    media_type: str
    data: bytes


class SessionAttachments:
    """Collector for one robot."""

    def __init__(self, namespace: str) -> None:
        self._namespace = namespace
        self._texts: dict[str, str] = {}
        self._orders: list[dict[str, Any]] = []
        self._hashes: list[str] = []

    def take(self, topic: str, payload: bytes) -> None:
        """Take a message of a topic in `KEPT`; an unreadable one is left for the reader to report."""
        try:
            if topic in _TEXTS:
                self._texts[topic] = decode(String, payload).data
            elif topic == topics.ORDERS.name and len(self._orders) < _MOST_ORDERS:
                order = decode(RobotOrder, payload)
                at_s = order.header.stamp.sec + order.header.stamp.nanosec / 1e9
                self._orders.append({"sim_time_s": at_s, "order": order.name, **order.details()})
            elif topic == topics.REPORT.name:
                self._hashes.append(decode(TraversalReport, payload).session_hash)
        except PayloadError:
            return

    @property
    def session_hashes(self) -> str:
        """Return the hashes of the traversals, one after another."""
        return " ".join(self._hashes)

    def attachments(self) -> Iterator[AttachedFile]:
        """Yield the causes as JSON files."""
        for topic, name in _TEXTS.items():
            if text := self._texts.get(topic):
                yield self._json(name, text)
        if self._orders:
            yield self._json("orders.json", json.dumps(self._orders, indent=1, ensure_ascii=False))

    def _json(self, name: str, text: str) -> AttachedFile:
        at = f"{self._namespace}/{name}" if self._namespace else name
        return AttachedFile(at, "application/json", text.encode())
