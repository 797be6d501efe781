"""Neighbours of a robot: the newest message of each robot that it has heard lately."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")


class Neighbours(Generic[T]):
    """Memory of the newest message of each robot, for algorithms of which each robot has one."""

    def __init__(self, keep_s: float = 2.0) -> None:
        """Forget messages that were sent longer ago than `keep_s`."""
        self._keep_s = keep_s
        self._new: list[tuple[str, T, float]] = []
        self._newest: dict[str, tuple[float, T]] = {}

    def note(self, sender: str, message: T, age_s: float) -> None:
        """Take a message, decoded, from `heard`."""
        self._new.append((sender, message, age_s))

    def known(self, now_s: float) -> dict[str, tuple[T, float]]:
        """Return the newest message of each robot and its age (s), by name; to be called in each `decide`.

        Args:
            now_s: Time since the team began, as of `Me`.
        """
        for sender, message, age_s in self._new:
            if sender not in self._newest or self._newest[sender][0] <= now_s - age_s:
                self._newest[sender] = (now_s - age_s, message)
        self._new.clear()
        self._newest = {name: each for name, each in self._newest.items() if now_s - each[0] <= self._keep_s}
        return {name: (message, now_s - sent_s) for name, (sent_s, message) in self._newest.items()}
