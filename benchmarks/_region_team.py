"""A team of light robots, which follow their plans exactly, and its regions, in one process."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans.plan_kernels import PlanLimits, samples_of
from touchline.coordination.regions.region_borders import RegionBorders, halo_m
from touchline.coordination.regions.region_hub import RegionHub
from touchline.coordination.regions.region_messages import (
    AllClaims,
    Letter,
    OwnedState,
    OwnerOrder,
    PlanOrder,
    RegionLife,
    RobotClaims,
    TimedPlan,
    ToRobot,
)
from touchline.core import timed_motion as t
from touchline.jobs.team.team_robot import TeamRobot
from touchline.onboard.executive.owner_fence import OwnerFence
from touchline.schemas.cdr import encode
from touchline.schemas.messages import PlanState
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import TeamScenario

LIMITS: Final = PlanLimits(
    speed_max_mps=0.5,
    acceleration_mps2=0.5,
    lateral_acceleration_mps2=0.5,
    yaw_rate_max_radps=2.0,
    yaw_acceleration_radps2=4.0,
    apart_m=0.4,
    wall_m=0.2,
    lead_steps=2,
    drive_steps=8,
    update_steps=8,
)
PERIOD_S: Final = LIMITS.update_steps * t.STEP_S
AREA_OF_ONE_M2: Final = 2.5
_PASSES: Final = 4
_ALIGNED_TICKS: Final = 400
_TEAM: Final = TeamScenario(avoid="plans")
THERE_M: Final = 0.3
_NUMBERS_BYTES: Final = 32
"""Numbers and name in a message between regions."""


def starts_of(robots: int, side_m: float, rng: np.random.Generator) -> dict[str, tuple[float, float, float]]:
    """Start of each robot on a square, by name: x, y (m), and a heading at random (rad)."""
    across = math.ceil(math.sqrt(robots))
    at = (np.arange(across) + 0.5) * side_m / across
    places = [(x, y) for y in at.tolist() for x in at.tolist()][:robots]
    headings = rng.uniform(-math.pi, math.pi, robots).tolist()
    return {f"tb{n}": (x, y, h) for n, ((x, y), h) in enumerate(zip(places, headings, strict=True))}


class LightRobot:
    """A robot that follows its plan exactly."""

    def __init__(self, name: str, x_m: float, y_m: float, heading_rad: float, limits: PlanLimits = LIMITS) -> None:
        samples = np.zeros((samples_of(limits), t.COLUMNS))
        samples[:, :3] = x_m, y_m, heading_rad
        self.name, self.plan = name, TimedPlan(samples, 0.0, 0.0)
        self.fence, self.owner = OwnerFence(), cast(RegionLife | None, None)
        self.adopted = self.decided = 0

    def receive(self, order: ToRobot, now_s: float) -> None:
        who = f"{order.owner.region}.{order.owner.life}"
        if isinstance(order, OwnerOrder):
            self.owner = order.owner if self.fence.take(who, order.epoch) else self.owner
        elif self.fence.obeys(who, order.epoch) and order.number > self.decided:
            self.decided = order.number
            if order.base == self.adopted and now_s <= order.plan.branch_s:
                self.adopted, self.plan = order.number, order.plan

    def state(self, stamp_s: float) -> OwnedState:
        return OwnedState(self.name, stamp_s, self.owner, self.fence.epoch, self.adopted, self.decided, self.plan)


class EmulatedRobot(LightRobot):
    """The same with an emulated robot that follows the plan: a `turtlebot2` with noise, slip and motor lag."""

    def __init__(self, name: str, x_m: float, y_m: float, heading_rad: float) -> None:
        super().__init__(name, x_m, y_m, heading_rad)
        start = Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
        self._robot = TeamRobot(_TEAM.setup(name, start), hashed=False)
        self._robot.begin_guided(plans=True)
        self.way = np.zeros((_ALIGNED_TICKS, 2))
        self._robot.drive(_ALIGNED_TICKS, self.way)
        state = self._robot.emulator.onboard.plan_state
        assert state is not None
        assert state.aligned, name

    def receive(self, order: ToRobot, now_s: float) -> None:
        before = self.adopted
        super().receive(order, now_s)
        if isinstance(order, PlanOrder) and self.adopted != before:
            self._robot.take_guidance(order.guidance)

    def drive(self) -> None:
        """Drive for a period; `way` has the true places then."""
        self.way = self.way[: round(100 * PERIOD_S)]
        self._robot.drive(len(self.way), self.way)


@dataclass
class Figures:
    """Measurements.

    Attributes:
        updates: Updates so far.
        planning_s: Time of each region's update.
        letters_s: Time for messages and their answers, all regions.
        messages: Number by kind.
        sizes: Bytes by kind.
        driving_s: Time of emulation.
        closest_m: Least distance of two centres, by plans.
        truly_closest_m: The same of emulated robots.
        driven_m: By all robots.
        arrivals: At goals.
    """

    updates: int = 0
    planning_s: list[float] = field(default_factory=list)
    letters_s: float = 0.0
    messages: Counter[str] = field(default_factory=Counter)
    sizes: Counter[str] = field(default_factory=Counter)
    driving_s: float = 0.0
    closest_m: float = math.inf
    truly_closest_m: float = math.inf
    driven_m: float = 0.0
    arrivals: int = 0


class RegionTeam:
    """Robots on a square, each to one goal after another anywhere in it."""

    def __init__(self, robots: int, columns: int, rows: int, seed: int = 0, *, emulated: bool = False) -> None:
        self._rng = np.random.default_rng(seed)
        self.side_m = math.sqrt(AREA_OF_ONE_M2 * robots)
        corners = [(0.0, 0.0), (self.side_m, 0.0), (self.side_m, self.side_m), (0.0, self.side_m)]
        edges = [tuple(np.linspace(0.0, self.side_m, n + 1).tolist()) for n in (columns, rows)]
        borders = RegionBorders(edges[0], edges[1], halo_m(LIMITS))
        make, starts = EmulatedRobot if emulated else LightRobot, starts_of(robots, self.side_m, self._rng)
        self.robots = {name: make(name, *start) for name, start in starts.items()}
        names = list(starts)
        self._goals = {name: self._goal() for name in names}
        self._before = np.array([(x, y) for x, y, _ in starts.values()])
        area = FreeArea.of(corners)
        self.hubs = [RegionHub(RegionLife(n, 1), -1.0, borders, area, names, LIMITS) for n in range(borders.count)]
        for hub in self.hubs:
            hub.region.repeats = 0
        self.now_s, self.figures = _ALIGNED_TICKS / 100.0 if emulated else 0.0, Figures()

    def _goal(self) -> tuple[float, float]:
        x, y = self._rng.uniform(0.4, self.side_m - 0.4, 2).tolist()
        return x, y

    def update(self) -> None:
        """Let a period pass."""
        self._look()
        for hub in self.hubs:
            begin = time.process_time()
            hub.update(self.now_s, self._goals)
            self.figures.planning_s.append(time.process_time() - begin)
        begin = time.process_time()
        self._report(self.robots, 0)
        for number in range(1, _PASSES + 1):
            self._exchange()
            orders = [order for hub in self.hubs for order in hub.region.orders()]
            for order in orders:
                self._count("order", _PLAN_BYTES * isinstance(order, PlanOrder) + _NUMBERS_BYTES)
                self.robots[order.robot].receive(order, self.now_s)
            self._report({order.robot: None for order in orders}, number)  # each once
        self.figures.letters_s += time.process_time() - begin
        self._drive()
        self.figures.updates += 1
        self.now_s = round(self.now_s + PERIOD_S, 6)

    def _drive(self) -> None:
        """Drive emulated robots, if they are."""
        emulated = [robot for robot in self.robots.values() if isinstance(robot, EmulatedRobot)]
        begin = time.process_time()
        for robot in emulated:
            robot.drive()
        self.figures.driving_s += time.process_time() - begin
        for tick in range(0, round(100 * PERIOD_S), 10) if emulated else ():
            places = np.array([robot.way[tick] for robot in emulated])
            self.figures.truly_closest_m = min(self.figures.truly_closest_m, _closest_m(places))

    def _look(self) -> None:
        """Look where all robots are over the next period, and give new goals to those that have arrived."""
        now = self._before
        for late_s in (0.0, 0.25 * PERIOD_S, 0.5 * PERIOD_S, 0.75 * PERIOD_S):
            places, sample = np.zeros((len(self.robots), 2)), np.zeros(t.COLUMNS)
            for row, robot in enumerate(self.robots.values()):
                t.motion_at(robot.plan.samples, self.now_s - late_s - robot.plan.start_s, sample)
                places[row] = sample[:2]
            if self.figures.updates:
                self.figures.closest_m = min(self.figures.closest_m, _closest_m(places))
            now = places if late_s == 0.0 else now
        self.figures.driven_m += float(np.hypot(*(now - self._before).T).sum())
        self._before = now
        for name, (x, y) in zip(self.robots, now.tolist(), strict=True):
            if math.hypot(x - self._goals[name][0], y - self._goals[name][1]) < THERE_M:
                self.figures.arrivals += 1
                self._goals[name] = self._goal()

    def _report(self, names: Iterable[str], number: int) -> None:
        for name in names:
            state = self.robots[name].state(self.now_s + 1e-3 * number)
            self._count("report", _REPORT_BYTES)
            for hub in self.hubs:
                hub.region.hear(state)

    def _exchange(self) -> None:
        """Carry all letters over, and the answers back."""
        letters = [letter for hub in self.hubs for letter in hub.region.letters()]
        while letters:
            answers: list[Letter] = []
            for letter in letters:
                self._count("letter", _bytes_of(letter))
                answers += self.hubs[letter.to].region.receive(letter)
            letters = answers

    def _count(self, kind: str, size: int) -> None:
        self.figures.messages[kind] += 1
        self.figures.sizes[kind] += size


def _closest_m(places: NDArray[np.float64]) -> float:
    """Return the least distance of two of some places (n, 2)."""
    return float(np.asarray(cKDTree(places).query(places, k=2)[0])[:, 1].min())


_PLAN_BYTES: Final = 8 * t.COLUMNS * int(samples_of(LIMITS))
_REPORT_BYTES: Final = len(encode(PlanState()))


def _bytes_of(letter: Letter) -> int:
    message = letter.message
    all_claims = message.claims if isinstance(message, AllClaims) else ()
    claims = (message,) if isinstance(message, RobotClaims) else all_claims
    plans = sum(len(each.plans) for each in claims)
    return _NUMBERS_BYTES * (1 + len(claims)) + _PLAN_BYTES * plans
