"""Which processes are there, and how they say they are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from schemas.messages.standard import DiagnosticArray

SILENT_AFTER_S = 4.0
"""A live process that has not reported for this long (it does so every second) has stopped working."""


@dataclass
class Node:
    """One process: whether its liveliness token is there, and its last report."""

    name: str
    alive: bool = False
    seen: bool = False
    report_s: float | None = None
    level: int = 0
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)

    def number(self, key: str) -> float | None:
        """A reported value as a finite number."""
        try:
            value = float(self.values[key])
        except (KeyError, ValueError):
            return None
        return value if math.isfinite(value) else None

    def silent(self, now_s: float) -> bool:
        """Alive, but no longer reporting as it used to."""
        return self.alive and self.report_s is not None and now_s - self.report_s > SILENT_AFTER_S


def take_report(nodes: dict[str, Node], report: DiagnosticArray, now_s: float) -> None:
    """Note what processes say about themselves; a status is named for its process, or `process: component`."""
    for status in report.status:
        name = status.name.split(":", 1)[0].strip().removeprefix("/")
        if not name:
            continue
        node = nodes.setdefault(name, Node(name))
        fresh = node.report_s != now_s
        if fresh:
            node.level, node.message = 0, ""
        node.report_s = now_s
        if status.level >= node.level:
            node.level, node.message = status.level, status.message
        node.values.update({pair.key: pair.value for pair in status.values})
