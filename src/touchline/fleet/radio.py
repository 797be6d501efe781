"""Radio between a team and its coordinator: messages are lost, late, and overtake each other."""

from __future__ import annotations

from typing import Generic, TypeVar

from touchline.core.random import STREAM_RADIO, uniform
from touchline.schemas.team import TeamLinks

M = TypeVar("M")


class Radio(Generic[M]):
    """One direction of it, reproducible by its seed: what becomes of a message depends on nothing else.

    Args:
        links: What is lost and late.
        seed: Of the session.
        direction: Another number for each direction.
    """

    def __init__(self, links: TeamLinks, seed: int, direction: int) -> None:
        self._links, self._seed, self._direction = links, seed, direction
        self._under_way: list[tuple[float, int, str, M]] = []
        self._sent = 0

    def send(self, tick: int, name: str, message: M) -> None:
        """Send a message from or to a robot.

        Args:
            tick: When.
            name: Of the robot.
            message: What is sent.
        """
        self._sent += 1
        channel = 4 * self._sent + 2 * self._direction
        if uniform(self._seed, STREAM_RADIO, tick, channel) < self._links.loss:
            return
        late_s = self._links.delay_s * uniform(self._seed, STREAM_RADIO, tick, channel + 1)
        self._under_way.append((tick / 100.0 + late_s, self._sent, name, message))

    def arrived(self, tick: int) -> list[tuple[str, M]]:
        """What has arrived by a tick, in the order of arrival: whose, and what."""
        now_s = tick / 100.0
        due = sorted((each for each in self._under_way if each[0] <= now_s), key=lambda each: each[:2])
        self._under_way = [each for each in self._under_way if each[0] > now_s]
        return [(name, message) for _, _, name, message in due]
