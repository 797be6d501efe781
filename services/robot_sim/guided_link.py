"""A guided robot's link to its team's coordinator over the bus; in lockstep, sim time is held until that answers.

The robot believes the coordinator that it has joined, and no other session: whoever else sends it guidance is told of.
In lockstep it also tells where the robot truly was since the last exchange: no robot knows where the others are, so who
touches whom, and has its bumper pressed, is found by who hears them all.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.bus import Bus
from touchline.bus.attachment import session_publisher
from touchline.onboard.interface import OnboardEvent
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Event, Guidance, TrueWay
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.packing import Payload, header
from touchline.services.robot_sim.tick_log import TRUTH, Rows

PATIENCE_S: Final = 10.0
"""Wall clock: a coordinator that has not answered for so long is waited for no more, until it answers again."""
_NEVER: Final = 1 << 30
_LOOK_S: Final = 0.2
"""Wall time between two looks whether the coordinator is still on the bus."""
_STRANGERS: Final = 8
"""So many are told of while a robot is guided."""


class GuidedLink:
    """See the module.

    Args:
        bus: Of the robot.
        emulator: The robot.
    """

    def __init__(self, bus: Bus, emulator: Emulator) -> None:
        self._bus, self._inbox = bus, bus.inbox([topics.GUIDANCE])
        self._coordinator, self._believed = "", b""
        self._strangers: set[bytes] = set()
        self._news: list[OnboardEvent] = []
        self._there, self._look_at_s = True, 0.0
        self._emulator = emulator
        self._step = 0
        self._answered_tick = -1
        self._held_since_s = math.inf
        self._waits = True
        self._way: list[NDArray[np.float64]] = []

    def begin(self, coordinator: str, lockstep_s: float) -> None:
        """The robot is guided from now on.

        Args:
            coordinator: Id of the session by which.
            lockstep_s: At every multiple of it the robot waits for an answer; 0: it never does.
        """
        self._coordinator, self._believed = coordinator, session_publisher(coordinator)
        self._strangers, self._news, self._there, self._look_at_s = set(), [], True, 0.0
        self._inbox.drain()
        self._way = []
        self._step = round(100 * lockstep_s)
        self._answered_tick, self._waits, self._held_since_s = self._emulator.tick_count, True, math.inf

    def turn(self, now_s: float) -> list[OnboardEvent]:
        """Take what the coordinator has sent; returns what the operator should know.

        Args:
            now_s: Monotonic wall time.
        """
        self._take()
        if self.under_way:
            self._look_for_coordinator(now_s)
        news, self._news = self._news, []
        return news

    def _take(self) -> None:
        """Take guidance of the coordinator, and note who else sends some."""
        for sample, message in self._inbox.messages():
            if sample.publisher != self._believed:
                self._ignore(sample.publisher)
            elif isinstance(message, Guidance):
                self._emulator.take_guidance(message)
                stamp = message.header.stamp
                self._answered_tick = max(self._answered_tick, 100 * stamp.sec + stamp.nanosec // 10_000_000)

    def _ignore(self, publisher: bytes) -> None:
        """Note one who is not believed, once."""
        if not self.under_way or publisher in self._strangers or len(self._strangers) == _STRANGERS:
            return
        self._strangers.add(publisher)
        who = publisher.hex() or "unknown"
        text = f"guidance of publisher {who} is ignored: the robot is guided by session {self._coordinator}"
        self._news.append(OnboardEvent(Event.WARN, "stranger", text))

    def _look_for_coordinator(self, now_s: float) -> None:
        """Note once that it has gone; what it has told last ends with its lease, and then the robot brakes."""
        if not self._there or now_s < self._look_at_s:
            return
        self._look_at_s = now_s + _LOOK_S
        self._there = self.knows(self._coordinator)
        if not self._there:
            text = "the coordinator has left the bus: the robot stops and waits; abort, and have it guided anew"
            self._news.append(OnboardEvent(Event.ERROR, "coordinator-lost", text))

    def knows(self, session: str) -> bool:
        """Whether a session is on the bus as a coordinator, by its liveliness token; in any thread."""
        return session in self._bus.sessions(topics.COORDINATOR)

    @property
    def under_way(self) -> bool:
        """Whether the robot is guided: it tells where it is until that ends."""
        return self._emulator.onboard.guided

    @property
    def in_step(self) -> bool:
        """Whether sim time waits for the coordinator, and so does not go by the wall clock."""
        return self._step > 0 and self.under_way

    def ticks_ahead(self) -> int:
        """How many ticks may pass before the next answer is needed."""
        if not self.in_step:
            return _NEVER
        return self._step - self._emulator.tick_count % self._step

    def drove(self, rows: Rows) -> list[Payload]:
        """Messages about ticks that have passed, rows (n, tick_log.columns): at an exchange, the robot's place then."""
        if not self.in_step:
            return []
        self._way.append(rows[:, TRUTH : TRUTH + 2].copy())
        tick = self._emulator.tick_count
        if tick % self._step:
            return []
        x_m, y_m = np.ascontiguousarray(np.concatenate(self._way).T)
        self._way = []
        return [(topics.TRUE_WAY, encode(TrueWay(header=header(tick), x_m=x_m, y_m=y_m)))]

    def held(self, now_s: float) -> bool:
        """Whether sim time has to wait for an answer.

        Args:
            now_s: Monotonic wall time.
        """
        tick = self._emulator.tick_count
        at_gate = self._step and tick % self._step == 0 and self._answered_tick < tick
        if not at_gate or not self.under_way:
            self._held_since_s = math.inf
            self._waits = self._waits or self._answered_tick == tick
            return False
        self._take()
        if self._answered_tick >= tick:
            self._waits = True
            return False
        self._held_since_s = min(self._held_since_s, now_s)
        if now_s - self._held_since_s > PATIENCE_S:
            self._waits = False
        return self._waits
