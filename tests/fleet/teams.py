"""Teams of unicycles and a hub, over links that lose and delay messages or do not, and robots that freeze."""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.fleet.all_at_once import stopping_segments
from tests.fleet.unicycles import LIMITS, drive
from touchline.coordination.free_area import FreeArea
from touchline.coordination.hub import Hub
from touchline.coordination.kernels.clipping import clip_all
from touchline.coordination.tasks import GoalLists, TeamTask, swap
from touchline.onboard.executive.cell_keeper import CellKeeper, Segment
from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.onboard import TeamLimits

Floats = NDArray[np.float64]

TICK_S, TICKS_PER_MESSAGE, MESSAGES_PER_UPDATE = 0.02, 5, 4
PERIOD_S = TICK_S * TICKS_PER_MESSAGE * MESSAGES_PER_UPDATE
TEAM_LIMITS = TeamLimits(lease_s=2.4, doubt_m=0.0)
# Farther out (m) than any cell that matters.
_FAR_M = 99.0


def seeds(count: int) -> pytest.MarkDecorator:
    """The first seed; the others in `make test-full`."""
    others = (pytest.param(seed, marks=pytest.mark.full) for seed in range(1, count))
    return pytest.mark.parametrize("seed", [0, *others])


def square(side_m: float) -> FreeArea:
    return FreeArea.of([(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)])


def names_of(robots: int) -> list[str]:
    return [f"tb{number:02}" for number in range(1, robots + 1)]


def corner_grid(robots: int, apart_m: float = 0.48) -> Floats:
    """(n, 4) robots at rest in a square grid in the corner."""
    across = math.ceil(math.sqrt(robots))
    number = np.arange(robots)
    places = 0.3 + apart_m * np.column_stack((number % across, number // across))
    return np.column_stack((places, np.zeros((robots, 2))))


def on_circle(robots: int, radius_m: float, middle_m: float, seed: int) -> Floats:
    """(n, 4) robots at rest on a circle, a little off their even places, headings anyhow."""
    rng = np.random.default_rng(seed)
    angle = math.tau * (np.arange(robots) + rng.uniform(-0.05, 0.05, robots)) / robots
    places = middle_m + radius_m * np.column_stack((np.cos(angle), np.sin(angle)))
    return np.column_stack((places, rng.uniform(-math.pi, math.pi, robots), np.zeros(robots)))


def swapped(states: Floats) -> tuple[GoalLists, Floats]:
    """The task to change places, and the goals (n, 2)."""
    places = {name: (x, y) for name, (x, y) in zip(names_of(len(states)), states[:, :2].tolist(), strict=True)}
    return swap(places), 2.0 * states[:, :2].mean(axis=0) - states[:, :2]


def whereabouts(row: Floats, **figures: float) -> Whereabouts:
    """Of a robot with this stopping segment (4,) or at this place (2,)."""
    x, y, stop_x, stop_y = (*row, *row)[:4]
    return Whereabouts(x_m=x, y_m=y, stop_x_m=stop_x, stop_y_m=stop_y, **figures)


def stacked(cells: list[Floats]) -> Floats:
    """(n, k, 3) half-planes of cells (k_i, 3), filled up with rows that say nothing."""
    rows = np.zeros((len(cells), max(map(len, cells), default=0), 3))
    for row, cell in zip(rows, cells, strict=True):
        row[: len(cell)] = cell
    return rows


def corners_of(half_planes: Floats) -> Floats:
    """(c, 2) corners of a cell."""
    box = np.array([(-_FAR_M, -_FAR_M), (_FAR_M, -_FAR_M), (_FAR_M, _FAR_M), (-_FAR_M, _FAR_M)])
    room = np.empty((2, len(half_planes) + 4, 2))
    return room[1, : clip_all(box, 4, half_planes, room[0], room[1])]


@dataclass
class Weather:
    """Losses and delays of messages, and frozen robots: by name, with begin and end (s)."""

    lost: float = 0.0
    delay_s: float = 0.0
    frozen: tuple[tuple[str, float, float], ...] = ()

    def frozen_at(self, now_s: float) -> set[str]:
        return {who for who, since_s, until_s in self.frozen if since_s <= now_s < until_s}


FAIR = Weather()
FOUL = Weather(lost=0.5, delay_s=1.0)


class Letter(NamedTuple):
    """A message on its way."""

    at_s: float
    name: str
    message: Any


_ARRIVAL = attrgetter("at_s")


class Team:
    """Driven tick by tick.

    Attributes:
        states: (n, 4) X to SPEED, in the order of `names`.
        now_s: Of the next tick.
        closest_m: The least distance of two centres so far.
        driven_m: (n,) how far each has driven, straight from message to message.
    """

    def __init__(self, states: Floats, area: FreeArea, task: TeamTask, weather: Weather = FAIR, seed: int = 0) -> None:
        self.states, self.weather, self.rng = states.copy(), weather, np.random.default_rng(seed)
        self.names = names_of(len(states))
        self.ticks, self.now_s, self.closest_m, self.driven_m = 0, 0.0, math.inf, np.zeros(len(states))
        self.hub = Hub(area, task, {name: self._at(row) for name, row in zip(self.names, states, strict=True)})
        self.keepers = {name: CellKeeper(TEAM_LIMITS) for name in self.names}
        self.to_hub: list[Letter] = []
        self.to_robots: list[Letter] = []
        self._aim()

    def run(self, until_s: float) -> None:
        while self.now_s < until_s - 0.5 * TICK_S:
            frozen = self.weather.frozen_at(self.now_s)
            self._exchange(frozen)
            self._drive(frozen)
            self.ticks += 1
            self.now_s = self.ticks * TICK_S

    def run_until(self, seen: Callable[[], bool], latest_s: float) -> None:
        """Drive until something is seen, which is looked for every second; fails if it is not seen by the latest."""
        while not seen():
            assert self.now_s < latest_s
            self.run(self.now_s + 1.0)

    def join(self, name: str, state: Floats) -> None:
        """Another robot stands there; its name is the last in the alphabet."""
        self.names.append(name)
        self.states, self.driven_m = np.vstack((self.states, state)), np.append(self.driven_m, 0.0)
        self.keepers[name] = CellKeeper(TEAM_LIMITS)
        self.hub.join(name, self._at(state), self.now_s)
        self._aim()

    def leave(self, name: str) -> None:
        """A robot is carried off."""
        gone = self.names.index(name)
        self.states, self.driven_m = np.delete(self.states, gone, axis=0), np.delete(self.driven_m, gone)
        self.names.remove(name)
        del self.keepers[name]
        self.to_hub, self.to_robots = ([each for each in box if each.name != name] for box in self._boxes)
        self.hub.leave(name)
        self._aim()

    def may_drive(self, name: str) -> bool:
        """Unless it is frozen."""
        keeper = self.keepers[name]
        return len(keeper.half_planes) > 0 and self.now_s <= keeper.until_s

    def cells_in_use(self, name: str) -> list[Floats]:
        """Half-planes of the cells that a robot keeps to, or will or may when it gets what is on its way to it."""
        keeper = self.keepers[name]
        decided = keeper.report(0.0, (0j, 0j)).decided
        coming = [each.message for each in self.to_robots if each.name == name and each.message.number > decided]
        return [keeper.half_planes, *(np.reshape(told.half_planes, (-1, 3)) for told in coming)]

    @property
    def _boxes(self) -> tuple[list[Letter], list[Letter]]:
        return self.to_hub, self.to_robots

    def _at(self, state: Floats) -> Whereabouts:
        return whereabouts(stopping_segments(state[None], LIMITS.acceleration_mps2)[0], stamp_s=self.now_s)

    def _segments(self) -> dict[str, Segment]:
        rows = stopping_segments(self.states, LIMITS.acceleration_mps2).tolist()
        return {name: (complex(*row[:2]), complex(*row[2:])) for name, row in zip(self.names, rows, strict=True)}

    def _post(self, box: list[Letter], name: str, message: Guidance | Whereabouts) -> None:
        if self.rng.uniform() >= self.weather.lost:
            letter = Letter(self.now_s + self.rng.uniform(0.0, self.weather.delay_s), name, message)
            insort(box, letter, key=_ARRIVAL)

    def _come(self, box: list[Letter]) -> list[Letter]:
        """Those that have come, in the order in which they do."""
        count = bisect_right(box, self.now_s, key=_ARRIVAL)
        come, box[:count] = box[:count], []
        return come

    def _exchange(self, frozen: set[str]) -> None:
        told_now = self.ticks % TICKS_PER_MESSAGE == 0
        if not (told_now or self.to_hub or self.to_robots):
            return
        if told_now:
            segments = self._segments()
            for name in self.names:
                if name not in frozen:
                    self._post(self.to_hub, name, self.keepers[name].report(self.now_s, segments[name]))
        for _, name, message in self._come(self.to_hub):
            self.hub.receive(name, message, self.now_s)
        if self.ticks % (TICKS_PER_MESSAGE * MESSAGES_PER_UPDATE) == 0:
            self.hub.update(self.now_s)
        if told_now:
            for name, message in self.hub.guidance().items():
                self._post(self.to_robots, name, message)
        if come := self._come(self.to_robots):
            segments = self._segments()
            for _, name, message in come:
                if name not in frozen:
                    self.keepers[name].receive(message, segments[name])
            self._aim()

    def _aim(self) -> None:
        """See to it that all drive by what they have been told."""
        keepers = [self.keepers[name] for name in self.names]
        self._rows = stacked([keeper.half_planes for keeper in keepers])
        self._targets = np.array([keeper.target_m for keeper in keepers])

    def _drive(self, frozen: set[str]) -> None:
        may_drive = np.array([name not in frozen and self.may_drive(name) for name in self.names])
        before = self.states[:, :2].copy()
        self.closest_m = min(
            self.closest_m, drive(self.states, self._rows, self._targets, may_drive, LIMITS, TICK_S, 1)
        )
        self.driven_m += np.hypot(*(self.states[:, :2] - before).T)


def driven(states: Floats, area: FreeArea, task: TeamTask, until_s: float, goals: Floats | None = None) -> Team:
    """A team of which no message is lost, driven until a time, or until all are within 0.1 m of their goals (n, 2)."""
    team = Team(states, area, task)
    while team.now_s < until_s - 0.5 * TICK_S:
        team.run(team.now_s + PERIOD_S)
        if goals is not None and np.hypot(*(team.states[:, :2] - goals).T).max() < 0.1:
            break
    return team
