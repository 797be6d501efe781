"""Radio between a team and its coordinator: messages are lost, late, and overtake each other."""

from __future__ import annotations

from typing import Generic, TypeVar

from touchline.core.random import STREAM_RADIO, uniform
from touchline.schemas.team import TeamLinks

M = TypeVar("M")


class Radio(Generic[M]):
    """One direction of the radio, reproducible by its seed: the fate of a message depends on nothing else.

    Args:
        links: Loss and delay.
        seed: Seed of the session.
        direction: A different number for each direction.
    """

    def __init__(self, links: TeamLinks, seed: int, direction: int) -> None:
        self._links, self._seed, self._direction = links, seed, direction
        self._under_way: list[tuple[float, int, str, M]] = []
        self._sent = 0

    def send(self, tick: int, name: str, message: M) -> None:
        """Send a message from or to a robot.

        Args:
            tick: Time of sending.
            name: Name of the robot.
            message: The message.
        """
        self._sent += 1
        channel = 4 * self._sent + 2 * self._direction
        if uniform(self._seed, STREAM_RADIO, tick, channel) < self._links.loss:
            return
        late_s = self._links.delay_s * uniform(self._seed, STREAM_RADIO, tick, channel + 1)
        self._under_way.append((tick / 100.0 + late_s, self._sent, name, message))

    def arrived(self, tick: int) -> list[tuple[str, M]]:
        """Return messages that have arrived by a tick, in the order of arrival, with the robots' names."""
        now_s = tick / 100.0
        due = sorted((each for each in self._under_way if each[0] <= now_s), key=lambda each: each[:2])
        self._under_way = [each for each in self._under_way if each[0] > now_s]
        return [(name, message) for _, _, name, message in due]
