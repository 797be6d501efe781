"""Radio between the robots of a team: who hears whom, what is lost, how late the rest is."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.core.random import STREAM_RADIO, uniform
from touchline.schemas.team import TeamRadio

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# Channels of random numbers: those of the radio to the coordinator are below.
_CHANNELS: Final = 1 << 40
_SENDERS, _RECEIVERS = 1 << 17, 1 << 1
_BURST_S: Final = 1.0
"""Time for which a silent robot may save up what it can send."""


class _Letter(NamedTuple):
    """Message under way: when it was sent and is there (s), and from whom."""

    sent_s: float
    there_s: float
    sender: str
    payload: bytes


@dataclass
class RadioFigures:
    """Figures of the radio.

    Attributes:
        rounds: Updates in which robots could send.
        sent: Messages sent.
        sent_bytes: Their lengths.
        delivered: Messages received: one that several robots receive counts several times.
        lost: Messages lost on the way to a receiver.
        refused: Messages not sent as their sender had sent too much.
    """

    rounds: int = 0
    sent: int = 0
    sent_bytes: int = 0
    delivered: int = 0
    lost: int = 0
    refused: int = 0


class PeerRadio:
    """Radio of a team, reproducible: the fate of a message depends on seed, sender, receiver and round alone.

    Attributes:
        figures: Figures so far.
    """

    def __init__(
        self, radio: TeamRadio, number_of: Callable[[str], int], area: FreeArea, seed: int, period_s: float
    ) -> None:
        """Connect robots.

        Args:
            radio: Its properties.
            number_of: Number of a robot, by its name: further robots change nobody else's luck.
            area: The area, whose walls may stop messages.
            seed: Seed of the run.
            period_s: Time between rounds.
        """
        self._radio, self._number_of, self._area, self._seed = radio, number_of, area, seed
        self._period_s = period_s
        self._letters: defaultdict[str, list[_Letter]] = defaultdict(list)
        self._saved_bytes: defaultdict[str, float] = defaultdict(lambda: radio.bytes_per_s * _BURST_S)
        self.figures = RadioFigures()

    def exchange(self, now_s: float, messages: Mapping[str, bytes], places: Mapping[str, complex]) -> None:
        """Send the messages of a round.

        Args:
            now_s: Time.
            messages: Message of each robot that sends one.
            places: Where each robot is (m).
        """
        self.figures.rounds += 1
        names = list(places)
        connected = self._connected(names, np.array(list(places.values()))) if messages else np.zeros((0, 0))
        for row, sender in enumerate(names):
            self._saved_bytes[sender] = min(
                self._saved_bytes[sender] + self._radio.bytes_per_s * self._period_s, self._radio.bytes_per_s * _BURST_S
            )
            if (payload := messages.get(sender)) is None:
                continue
            if len(payload) > self._saved_bytes[sender]:
                self.figures.refused += 1
                continue
            self._saved_bytes[sender] -= len(payload)
            self.figures.sent += 1
            self.figures.sent_bytes += len(payload)
            for column in np.flatnonzero(connected[row]).tolist():
                self._send(now_s, sender, names[column], payload)

    def _send(self, now_s: float, sender: str, receiver: str, payload: bytes) -> None:
        radio, round_ = self._radio, self.figures.rounds
        channel = _CHANNELS + _SENDERS * self._number_of(sender) + _RECEIVERS * self._number_of(receiver)
        if uniform(self._seed, STREAM_RADIO, round_, channel) < radio.loss:
            self.figures.lost += 1
            return
        share = uniform(self._seed, STREAM_RADIO, round_, channel + 1)
        late_s = radio.delay_least_s + (radio.delay_most_s - radio.delay_least_s) * share
        self._letters[receiver].append(_Letter(now_s, now_s + late_s, sender, payload))

    def received(self, receiver: str, now_s: float) -> list[tuple[str, bytes, float]]:
        """Return messages that a robot has received since the last call: sender, payload, age (s), as they came."""
        letters = self._letters[receiver]
        come = sorted((each for each in letters if each.there_s <= now_s), key=lambda each: (each.there_s, each.sender))
        self._letters[receiver] = [each for each in letters if each.there_s > now_s]
        self.figures.delivered += len(come)
        return [(each.sender, each.payload, now_s - each.sent_s) for each in come]

    def _connected(self, names: list[str], places: NDArray[np.complex128]) -> Bools:
        """Return (n, n) whether the second of two robots hears the first."""
        off_m = np.abs(places[:, None] - places[None])
        np.fill_diagonal(off_m, np.inf)
        if self._radio.topology == "disc":
            found = off_m <= self._radio.range_m
        elif self._radio.topology == "nearest":
            rank = off_m.argsort(axis=0, kind="stable").argsort(axis=0, kind="stable")
            found = (rank < self._radio.nearest) & np.isfinite(off_m)
        else:
            found = np.array([[to in self._radio.graph.get(sender, ()) for to in names] for sender in names])
        return found & self._in_sight(places, found) if self._radio.walls else found

    def _in_sight(self, places: NDArray[np.complex128], asked: Bools) -> Bools:
        """Return (n, n) whether no wall is between two robots, where that is asked."""
        import shapely

        here = np.column_stack((places.real, places.imag))
        one, other = np.nonzero(asked)
        seen = np.zeros_like(asked)
        lines = shapely.linestrings(np.stack((here[one], here[other]), axis=1))
        seen[one, other] = shapely.covers(self._area.shape, lines)
        return seen
