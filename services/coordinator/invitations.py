"""Whom to ask to join a team, and when: at once who comes to the bus, ever more rarely who refuses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

FIRST_PAUSE_S: Final = 1.0
"""Wall time: one that has just come to the bus may not be ready, and is asked again so soon…"""
MOST_PAUSE_S: Final = 30.0
"""…and after twice as long each time, up to this."""


@dataclass
class _Invited:
    """When a robot is to be asked again (inf: not before it has answered), and how long the pause before was (s)."""

    again_s: float
    pause_s: float = 0.0


class Invitations:
    """See the module; times are of a monotonic clock."""

    def __init__(self) -> None:
        """Nobody has come."""
        self._invited: dict[str, _Invited] = {}
        self._reasons: dict[str, str] = {}

    def due(self, there: Iterable[str], now_s: float) -> list[str]:
        """Whom to ask now; who is gone from the bus has to come anew.

        Args:
            there: Who is on the bus.
            now_s: Now.
        """
        self._invited = {name: self._invited.get(name) or _Invited(now_s) for name in there}
        found = [name for name, each in self._invited.items() if each.again_s <= now_s]
        for name in found:
            self._invited[name].again_s = math.inf
        return found

    def joins(self, name: str) -> None:
        """It has said that it does, or does already: it is not asked before it comes anew."""
        self._invited.setdefault(name, _Invited(math.inf)).again_s = math.inf
        self._reasons.pop(name, None)

    def refuses(self, name: str, reason: str, now_s: float) -> bool:
        """It does not join; returns whether that, or the reason, is news."""
        if (each := self._invited.get(name)) is not None:
            each.pause_s = min(max(FIRST_PAUSE_S, 2.0 * each.pause_s), MOST_PAUSE_S)
            each.again_s = now_s + each.pause_s
        news = self._reasons.get(name) != reason
        self._reasons[name] = reason
        return news
