"""A region, or the robots that begin in it, as a process of its own: a client of a Zenoh router.

`python -m benchmarks._region_process region|robots NUMBER SETTINGS.json`; prints its figures as JSON at the end. All
processes are of one machine, whose clock is the robots' clock, at a multiple of real time.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import zenoh
from zenoh import handlers

from benchmarks._region_team import AREA_OF_ONE_M2, LIMITS, THERE_M, LightRobot, RegionTeam, starts_of
from touchline.coordination.free_area import FreeArea
from touchline.coordination.regions.region_borders import RegionBorders, halo_m
from touchline.coordination.regions.region_codec import decode_bundle, encode_bundle
from touchline.coordination.regions.region_hub import RegionHub
from touchline.coordination.regions.region_messages import Letter, OwnerOrder, PlanOrder, RegionLife
from touchline.core import timed_motion as t

_LEAD_STEPS: Final = 12
"""Steps in which a plan must have been granted by neighbours, and be at its robot: 0.6 s."""
LATE: Final = LIMITS._replace(lead_steps=_LEAD_STEPS, drive_steps=_LEAD_STEPS)
PERIOD_S: Final = LATE.update_steps * t.STEP_S
TICK_S: Final = 0.1
"""Time from one look at true places to the next."""
_AGAIN_S: Final = 1.0
"""Wall-clock time after which what has not been answered is sent again."""
_TURN_S: Final = 0.005
_MOST: Final = 100_000


class Settings(NamedTuple):
    """Settings of all processes; `begun_s` is the monotonic time at which the robots' clock is 0."""

    robots: int
    columns: int
    rows: int
    seconds: float
    speed: float
    begun_s: float
    endpoints: list[str]
    folder: str

    @property
    def side_m(self) -> float:
        return math.sqrt(AREA_OF_ONE_M2 * self.robots)

    @property
    def borders(self) -> RegionBorders:
        edges = [tuple(np.linspace(0.0, self.side_m, n + 1).tolist()) for n in (self.columns, self.rows)]
        return RegionBorders(edges[0], edges[1], halo_m(LATE))

    @property
    def starts(self) -> dict[str, tuple[float, float, float]]:
        """Start of each robot: x, y (m), heading (rad)."""
        return starts_of(self.robots, self.side_m, np.random.default_rng(0))

    @property
    def now_s(self) -> float:
        return (time.monotonic() - self.begun_s) * self.speed

    def homes(self) -> dict[str, int]:
        """Region in which each robot begins, by its name; its process is there, too."""
        borders = self.borders
        return {name: borders.at(x, y) for name, (x, y, _) in self.starts.items()}


class Link:
    """Bundles from and to other processes, by the router next to this one."""

    def __init__(self, endpoint: str, heard: Iterable[str]) -> None:
        config = zenoh.Config()
        for key, value in {
            "mode": "client",
            "connect/endpoints": [endpoint],
            "connect/timeout_ms": -1,
            "scouting/multicast/enabled": False,
        }.items():
            config.insert_json5(key, json.dumps(value))
        self._session = zenoh.open(config)
        self._inboxes = [self._session.declare_subscriber(key, handlers.FifoChannel(_MOST)) for key in heard]
        self.messages: Counter[str] = Counter()
        self.bytes: Counter[str] = Counter()

    def send(self, key: str, messages: list[Any]) -> None:
        if messages:
            payload = encode_bundle(messages)
            kind = key.partition("/")[0]
            self.messages[kind] += len(messages)
            self.bytes[kind] += len(payload)
            self._session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK)

    def heard(self) -> Iterable[Any]:
        for inbox in self._inboxes:
            while (sample := inbox.try_recv()) is not None:
                yield from decode_bundle(bytes(sample.payload))


class Repeats:
    """Letters sent a moment ago, which need not be sent again yet."""

    def __init__(self) -> None:
        self._sent_s: dict[Hashable, float] = {}

    def due(self, key: Hashable) -> bool:
        now_s = time.monotonic()
        if now_s - self._sent_s.get(key, -math.inf) < _AGAIN_S:
            return False
        self._sent_s[key] = now_s
        return True

    def forget(self) -> None:
        now_s = time.monotonic()
        self._sent_s = {key: at_s for key, at_s in self._sent_s.items() if now_s - at_s < _AGAIN_S}


class RegionProcess:
    """A region."""

    def __init__(self, number: int, settings: Settings) -> None:
        side_m, self._settings, self._homes = settings.side_m, settings, settings.homes()
        area = FreeArea.of([(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)])
        name = RegionLife(number, 1)
        self._hub = RegionHub(name, -1.0, settings.borders, area, list(self._homes), LATE)
        self._hub.region.repeats = 0
        self._link = Link(settings.endpoints[number], (f"letters/{number}", "reports"))
        self._goals: dict[str, tuple[float, float]] = {}
        self._letters, self._orders = Repeats(), Repeats()
        self._planning_s: list[float] = []
        self._late_s: list[float] = []
        self._periods = 0

    def turn(self) -> None:
        region = self._hub.region
        answers: list[Letter] = []
        for message in self._link.heard():
            if isinstance(message, Letter):
                answers += region.receive(message)
            else:
                state, x_m, y_m = message
                self._goals[state.robot] = x_m, y_m
                region.hear(state)
        now_s = self._settings.now_s
        if (period := math.floor(now_s / PERIOD_S)) > self._periods and len(self._goals) == len(self._homes):
            self._periods, begin_s = period, time.process_time()
            region.withdraw_late(now_s)
            self._hub.update(period * PERIOD_S, self._goals)
            self._planning_s.append(time.process_time() - begin_s)
            self._late_s.append(self._settings.now_s - period * PERIOD_S)
            self._letters.forget()
            self._orders.forget()
        self._send(answers)

    def _send(self, answers: list[Letter]) -> None:
        region = self._hub.region
        by_region: dict[int, list[Any]] = defaultdict(list)
        for letter in (*answers, *(each for each in region.letters() if self._letters.due(_name_of(each)))):
            by_region[letter.to].append(letter)
        for to, letters in by_region.items():
            self._link.send(f"letters/{to}", letters)
        by_host: dict[int, list[Any]] = defaultdict(list)
        for order in region.orders():
            number = order.number if isinstance(order, PlanOrder) else -1
            if self._orders.due((order.robot, order.epoch, number)):
                by_host[self._homes[order.robot]].append(order)
        for host, orders in by_host.items():
            self._link.send(f"orders/{host}", orders)

    def figures(self) -> dict[str, Any]:
        return {
            "handovers": self._hub.region.handed_over,
            "owned": len(self._hub.region.own),
            "planning_s": self._planning_s,
            "late_s": self._late_s,
            "messages": self._link.messages,
            "bytes": self._link.bytes,
        }


def _name_of(letter: Letter) -> Hashable:
    """Return the mark by which a letter is told from others: its version counts, not the plans in it."""
    return letter.to, type(letter.message).__name__, letter.message[:3] if len(letter.message) > 2 else letter.message


class RobotsProcess:
    """Robots that follow their plans exactly; each reports to all regions, and chooses its goals."""

    def __init__(self, number: int, settings: Settings) -> None:
        self._number, self._settings = number, settings
        self._rng, homes = np.random.default_rng(number), settings.homes()
        starts = settings.starts.items()
        self._robots = {name: LightRobot(name, *start, LATE) for name, start in starts if homes[name] == number}
        self._goals = {name: self._goal() for name in self._robots}
        self._link = Link(settings.endpoints[number], (f"orders/{number}",))
        self._places: list[np.ndarray[Any, Any]] = []
        self._reported_s = dict.fromkeys(self._robots, -1.0)
        self._owned_s: dict[str, float] = {}
        self._gaps_s: list[float] = []
        self._ticks = self._unplanned = self._adopted = self._refused = 0

    def _goal(self) -> tuple[float, float]:
        x, y = self._rng.uniform(0.4, self._settings.side_m - 0.4, 2).tolist()
        return x, y

    def turn(self) -> None:
        now_s = self._settings.now_s
        while self._ticks * TICK_S <= now_s:
            self._look(self._ticks * TICK_S)
            self._ticks += 1
        for order in self._link.heard():
            self._obey(order, now_s)
        due = [name for name, at_s in self._reported_s.items() if now_s >= at_s + PERIOD_S]
        self._reported_s |= dict.fromkeys(due, now_s)
        self._link.send("reports", [(self._robots[name].state(now_s), *self._goals[name]) for name in due])

    def _obey(self, order: OwnerOrder | PlanOrder, now_s: float) -> None:
        robot, name = self._robots[order.robot], order.robot
        before = robot.fence.epoch, robot.decided, robot.adopted
        robot.receive(order, now_s)
        if (robot.fence.epoch, robot.decided, robot.adopted) == before:
            return
        self._reported_s[name] = -1.0  # at once
        if robot.fence.epoch > before[0] > 0:
            self._owned_s[name] = now_s
        if robot.adopted > before[2]:
            self._adopted += 1
            if name in self._owned_s:
                self._gaps_s.append(now_s - self._owned_s.pop(name))
        elif robot.decided > before[1]:
            self._refused += 1

    def _look(self, at_s: float) -> None:
        """Note the true places at a time, who drives on without a new plan, and who is at its goal."""
        places, sample = np.zeros((len(self._robots), 2)), np.zeros(t.COLUMNS)
        driven_s = LATE.brakes_at * t.STEP_S
        for row, (name, robot) in enumerate(self._robots.items()):
            plan = robot.plan
            t.motion_at(plan.samples, at_s - plan.start_s, sample)
            places[row] = sample[: t.HEADING]
            self._unplanned += at_s - plan.start_s > driven_s + TICK_S
            if math.hypot(*(places[row] - self._goals[name])) < THERE_M:
                self._goals[name] = self._goal()
        self._places.append(places)

    def figures(self) -> dict[str, Any]:
        np.save(Path(self._settings.folder) / f"places-{self._number}.npy", np.array(self._places))
        return {
            "adopted": self._adopted,
            "refused": self._refused,
            "unplanned": self._unplanned,
            "gaps_s": self._gaps_s,
            "messages": self._link.messages,
            "bytes": self._link.bytes,
        }


def main(kind: str, number: int, settings: Settings) -> None:
    RegionTeam(4, 2, 2).update()  # compiles, or loads what is compiled
    process = (RegionProcess if kind == "region" else RobotsProcess)(number, settings)
    turn: Callable[[], None] = process.turn
    time.sleep(max(-settings.now_s / settings.speed, 0.0))
    begin_cpu_s = time.process_time()
    while settings.now_s < settings.seconds:
        begin_s = time.monotonic()
        turn()
        time.sleep(max(_TURN_S - (time.monotonic() - begin_s), 0.0))
    print(json.dumps({**process.figures(), "cpu_s": time.process_time() - begin_cpu_s}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Settings(**json.loads(Path(sys.argv[3]).read_text())))
