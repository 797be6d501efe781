"""Health of processes: presence, last report and silence."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from touchline.schemas.messages.standard import DiagnosticArray
from touchline.schemas.plain_text import plain

LIVE_S = 0.6
"""Silence from which a process is doubtful: three missing reports of five a second."""
NO_ANSWER_S = 3.0
"""Silence from which the wording is stronger."""
STARTING = "starting: "
"""Beginning of the report of a process that is starting, and is silent meanwhile."""


class Freshness(Enum):
    """Meaning of a process's silence."""

    LIVE = "live"
    STARTING = "starting"
    """Present, but not ready yet."""
    STALE = "stale"
    """Present, but silent."""
    GONE = "gone"


@dataclass
class Node:
    """Process: presence of its liveliness token, time of its last message, and its last report."""

    name: str
    alive: bool = False
    seen: bool = False
    heard_s: float = 0.0
    reported: bool = False
    level: int = 0
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)
    _report_s: float | None = None

    def number(self, key: str) -> float | None:
        """Return a reported value as a finite number, or None."""
        try:
            value = float(self.values[key])
        except (KeyError, ValueError):
            return None
        return value if math.isfinite(value) else None

    def heard(self, now_s: float) -> None:
        """Note a message from the process's loop."""
        self.heard_s, self.reported = now_s, True

    def appeared(self, alive: bool, now_s: float) -> None:
        """Note that the token came or went; earlier reports no longer count."""
        self.alive, self.seen = alive, self.seen or alive
        self.heard_s, self.reported = now_s, False
        self.level, self.message, self._report_s = 0, "", None
        self.values.clear()

    def silence_s(self, now_s: float) -> float:
        """Time (s) since its last message."""
        return max(now_s - self.heard_s, 0.0)

    def freshness(self, now_s: float) -> Freshness:
        """Freshness of the last report."""
        if not self.alive:
            return Freshness.GONE
        if self.message.startswith(STARTING):
            return Freshness.STARTING
        if self.silence_s(now_s) <= LIVE_S:
            return Freshness.LIVE
        return Freshness.STALE if self.reported else Freshness.STARTING

    def take(self, level: int, message: str, values: dict[str, str], now_s: float) -> None:
        """Note a status; of several that come together the worst counts."""
        if self._report_s != now_s:
            self.level, self.message = 0, ""
        self._report_s = now_s
        self.heard(now_s)
        if level >= self.level:
            self.level, self.message = level, message
        self.values.update(values)


def take_report(nodes: dict[str, Node], report: DiagnosticArray, now_s: float) -> tuple[str, ...]:
    """Note a diagnostics message; a status is named for its process, or `process: component`.

    Returns:
        Names of the processes.
    """
    names: list[str] = []
    for status in report.status:
        name = plain(status.name).split(":", 1)[0].strip().removeprefix("/")
        if name:
            values = {plain(pair.key): plain(pair.value) for pair in status.values}
            nodes.setdefault(name, Node(name)).take(status.level, plain(status.message), values, now_s)
            names.append(name)
    return tuple(dict.fromkeys(names))


def silence(silent_s: float) -> str:
    """Format a silence: STALE 1.2 s, NO ANSWER SINCE 3 s."""
    return f"STALE {silent_s:.1f} s" if silent_s < NO_ANSWER_S else f"NO ANSWER SINCE {silent_s:.0f} s"
