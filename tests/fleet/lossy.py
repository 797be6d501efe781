"""A team of unicycles and a hub whose messages are lost or late, and robots that freeze."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.fleet.kinematic import LIMITS, names_of
from tests.fleet.unicycles import brake, step
from touchline.services.fleet.cells import stopping_segments
from touchline.services.fleet.coordinator import TeamSettings
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.hub import Hub
from touchline.services.fleet.links import NumberedCell, RobotEnd, Whereabouts
from touchline.services.fleet.tasks import TeamTask

Floats = NDArray[np.float64]

TICK_S, TICKS_PER_MESSAGE, MESSAGES_PER_UPDATE = 0.05, 2, 4


@dataclass
class Weather:
    """What becomes of messages, and who is frozen: by name, from when until when (s)."""

    lost: float = 0.5
    delay_s: float = 1.0
    frozen: tuple[tuple[str, float, float], ...] = ()

    def is_frozen(self, name: str, now_s: float) -> bool:
        return any(name == who and since <= now_s < until for who, since, until in self.frozen)


class LossyTeam:
    """Driven tick by tick; `closest_m` is the least distance of two centres so far."""

    def __init__(self, states: Floats, area: FreeArea, task: TeamTask, weather: Weather, seed: int) -> None:
        self.states, self.weather, self.rng = states.copy(), weather, np.random.default_rng(seed)
        self.names = names_of(len(states))
        settings = TeamSettings()
        starts = [Whereabouts(name, 0.0, row) for name, row in zip(self.names, self._segments(), strict=True)]
        self.hub = Hub(area, task, starts, settings=settings)
        self.ends = {name: RobotEnd(name, settings.lease_s) for name in self.names}
        self.to_hub: list[tuple[float, Whereabouts]] = []
        self.to_robots: list[tuple[float, NumberedCell]] = []
        self.ticks, self.closest_m = 0, math.inf

    @property
    def now_s(self) -> float:
        return self.ticks * TICK_S

    def run(self, until_s: float) -> None:
        while self.now_s < until_s:
            self._exchange()
            self._drive()
            self.ticks += 1

    def _segments(self) -> Floats:
        return stopping_segments(self.states, LIMITS.acceleration_mps2)

    def _post(self, box: list, message: Whereabouts | NumberedCell) -> None:
        if self.rng.uniform() >= self.weather.lost:
            box.append((self.now_s + self.rng.uniform(0.0, self.weather.delay_s), message))

    def _exchange(self) -> None:
        segments = dict(zip(self.names, self._segments(), strict=True))
        awake = [name for name in self.names if not self.weather.is_frozen(name, self.now_s)]
        for at, heard in self.to_hub:
            if at <= self.now_s:
                self.hub.receive(heard, self.now_s)
        for at, told in self.to_robots:
            if at <= self.now_s and told.name in awake:
                self.ends[told.name].receive(told, segments[told.name])
        self.to_hub = [entry for entry in self.to_hub if entry[0] > self.now_s]
        self.to_robots = [entry for entry in self.to_robots if entry[0] > self.now_s]
        if self.ticks % (TICKS_PER_MESSAGE * MESSAGES_PER_UPDATE) == 0:
            self.hub.update(self.now_s)
        if self.ticks % TICKS_PER_MESSAGE == 0:
            for name in awake:
                self._post(self.to_hub, self.ends[name].say(self.now_s, segments[name]))
            for order in self.hub.say():
                self._post(self.to_robots, order)

    def _drive(self) -> None:
        for state, name in zip(self.states, self.names, strict=True):
            end = self.ends[name]
            if self.weather.is_frozen(name, self.now_s) or not end.may_drive(self.now_s) or end.kept is None:
                brake(state, LIMITS.acceleration_mps2, TICK_S)
            else:
                step(state, end.kept.cell.half_planes, np.array(end.kept.target_m), LIMITS, TICK_S)
        places = self.states[:, 0] + 1j * self.states[:, 1]
        apart = np.abs(places[:, None] - places[None])
        np.fill_diagonal(apart, math.inf)
        self.closest_m = min(self.closest_m, float(apart.min()))
