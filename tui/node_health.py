"""Health of processes: presence, last report and time since they were last heard."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from touchline.schemas.messages.standard import DiagnosticArray
from touchline.schemas.plain_text import plain

LIVE_S = 0.6
"""A process says how it is five times a second: after three that did not come, it is doubtful whether it works."""
NO_ANSWER_S = 3.0
"""From here on it is said in stronger words."""
STARTING = "starting: "
"""How the report of a process begins that is busy with its start, and says nothing meanwhile."""


class Freshness(Enum):
    """What the silence of a process means."""

    LIVE = "live"
    STARTING = "starting"
    """It is there, but has yet to say that it is ready."""
    STALE = "stale"
    """It is there, but says nothing any more."""
    GONE = "gone"


@dataclass
class Node:
    """One process: whether its liveliness token is there, when it was last heard, and its last report."""

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
        """A reported value as a finite number."""
        try:
            value = float(self.values[key])
        except (KeyError, ValueError):
            return None
        return value if math.isfinite(value) else None

    def heard(self, now_s: float) -> None:
        """Note a message from its own loop."""
        self.heard_s, self.reported = now_s, True

    def appeared(self, alive: bool, now_s: float) -> None:
        """Note that its token came or went; earlier reports no longer count."""
        self.alive, self.seen = alive, self.seen or alive
        self.heard_s, self.reported = now_s, False
        self.level, self.message, self._report_s = 0, "", None
        self.values.clear()

    def silence_s(self, now_s: float) -> float:
        """How long nothing has been heard of it."""
        return max(now_s - self.heard_s, 0.0)

    def freshness(self, now_s: float) -> Freshness:
        """Whether what is known of it holds now."""
        if not self.alive:
            return Freshness.GONE
        if self.message.startswith(STARTING):
            return Freshness.STARTING
        if self.silence_s(now_s) <= LIVE_S:
            return Freshness.LIVE
        return Freshness.STALE if self.reported else Freshness.STARTING

    def take(self, level: int, message: str, values: dict[str, str], now_s: float) -> None:
        """Note one of its statuses; of those that come together the worst counts."""
        if self._report_s != now_s:
            self.level, self.message = 0, ""
        self._report_s = now_s
        self.heard(now_s)
        if level >= self.level:
            self.level, self.message = level, message
        self.values.update(values)


def take_report(nodes: dict[str, Node], report: DiagnosticArray, now_s: float) -> tuple[str, ...]:
    """Note what processes say about themselves; a status is named for its process, or `process: component`.

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
    """A silence in words: STALE 1.2 s, NO ANSWER SINCE 3 s."""
    return f"STALE {silent_s:.1f} s" if silent_s < NO_ANSWER_S else f"NO ANSWER SINCE {silent_s:.0f} s"
