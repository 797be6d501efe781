"""Schedule of invitations to join a team: at once for newcomers on the bus, ever more rarely after refusals."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

FIRST_PAUSE_S: Final = 1.0
"""First pause, wall clock: a robot that has just come to the bus may not be ready…"""
MOST_PAUSE_S: Final = 30.0
"""…and largest pause; it doubles each time."""


@dataclass
class _Invited:
    """Time of a robot's next invitation (inf: not before it has answered), and the pause before the last one (s)."""

    again_s: float
    pause_s: float = 0.0


class Invitations:
    """Invitations by robot; times are of a monotonic clock."""

    def __init__(self) -> None:
        """Start without robots."""
        self._invited: dict[str, _Invited] = {}
        self._reasons: dict[str, str] = {}

    def due(self, there: Iterable[str], now_s: float) -> list[str]:
        """Return the robots to invite now; one that has left the bus starts over."""
        self._invited = {name: self._invited.get(name) or _Invited(now_s) for name in there}
        found = [name for name, each in self._invited.items() if each.again_s <= now_s]
        for name in found:
            self._invited[name].again_s = math.inf
        return found

    def joins(self, name: str) -> None:
        """Note that a robot joins or has joined: it is not invited again before it comes anew."""
        self._invited.setdefault(name, _Invited(math.inf)).again_s = math.inf
        self._reasons.pop(name, None)

    def refuses(self, name: str, reason: str, now_s: float) -> bool:
        """Note that a robot does not join; return whether that, or the reason, is new."""
        if (each := self._invited.get(name)) is not None:
            each.pause_s = min(max(FIRST_PAUSE_S, 2.0 * each.pause_s), MOST_PAUSE_S)
            each.again_s = now_s + each.pause_s
        news = self._reasons.get(name) != reason
        self._reasons[name] = reason
        return news
