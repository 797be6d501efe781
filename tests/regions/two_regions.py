"""Two regions and a robot that is handed to and fro between them, by a bad radio, with regions that crash."""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.coordination.regions.region import Neighbourhood, Region
from touchline.coordination.regions.region_messages import (
    Letter,
    OwnedState,
    OwnerOrder,
    PlanOrder,
    RegionLife,
    TimedPlan,
    ToRobot,
)
from touchline.core.timed_motion import COLUMNS, STEP_S
from touchline.onboard.executive.owner_fence import OwnerFence
from touchline.onboard.executive.plan_keeper import PlanKeeper

ROUND_TICKS: Final = 10
LATE_ROUNDS: Final = 7
LOST, DOUBLED = 0.5, 0.05
#: Rounds from a proposal to its branch, from there to braking, and from there to rest; the second is the update period.
LEAD, DRIVE, BRAKE = 24, 4, 10
HOPELESS = 6
ROBOT: Final = "tb1"
STEPS: Final = ("offered", "accepted", "owner sent", "fenced", "planned")
PLACES = Neighbourhood(frozenset((0, 1)), lambda plan: (0, 1))


def name_of(owner: RegionLife) -> str:
    return f"{owner.region}.{owner.life}"


def owner_of(name: str) -> RegionLife | None:
    return RegionLife(*map(int, name.split("."))) if name else None


class Robot:
    """Fence and plans of the real robot; what it follows is looked up by the number and epoch of its guidance."""

    def __init__(self) -> None:
        self.fence, self.keeper = OwnerFence(), PlanKeeper()
        self.plan = TimedPlan(np.zeros((2, COLUMNS)), 0.0, 0.0)

    def receive(self, order: ToRobot, tick: int) -> None:
        if isinstance(order, OwnerOrder):
            self.fence.take(name_of(order.owner), order.epoch)
        elif self.obeys(order) and self.keeper.receive(order.guidance, tick) and self.keeper.adopted == order.number:
            self.plan = order.plan if self.keeper.plan_tick == round(100 * order.plan.start_s) else self.plan

    def obeys(self, order: PlanOrder) -> bool:
        return self.fence.obeys(name_of(order.owner), order.epoch)

    def report(self, tick: int) -> OwnedState:
        keeper = self.keeper
        owner, epoch = owner_of(self.fence.owner), self.fence.epoch
        return OwnedState(ROBOT, tick / 100.0, owner, epoch, keeper.adopted, keeper.decided, self.plan)

    def stands(self, tick: int) -> bool:
        return tick >= self.keeper.plan_tick + 100 * STEP_S * (len(self.plan.samples) - 1)


class Unfenced(Robot):
    """Rule left out: it obeys former owners, too."""

    def obeys(self, order: PlanOrder) -> bool:
        return True


class Unasked(Region):
    """Rule left out: it plans before neighbours have granted."""

    def _granted(self, own: Any) -> bool:
        return True


class OnceOnly(Region):
    """Rule left out: OWNER is sent once."""

    def orders(self) -> list[ToRobot]:
        found = super().orders()
        sent = self.__dict__.setdefault("sent", set())
        fresh = [each for each in found if not isinstance(each, OwnerOrder) or each not in sent]
        sent.update(each for each in found if isinstance(each, OwnerOrder))
        return fresh


class Way(NamedTuple):
    """A message on its way; `to` is a region, or −1: the robot."""

    at: int
    number: int
    to: int
    message: Letter | ToRobot | OwnedState


@dataclass
class Course:
    """Figures of a run.

    Attributes:
        handovers: From one region to the other.
        crashes: How often a region has crashed after each of the steps of a handover had begun.
        astray: Rounds in which a region that may plan did not hold what the robot follows.
        stood: Lengths of the times for which it stood, in rounds.
        never: Whether it has stood for ever.
    """

    handovers: int = 0
    crashes: dict[str, int] = field(default_factory=lambda: dict.fromkeys(("", *STEPS), 0))
    astray: int = 0
    stood: list[int] = field(default_factory=list)
    never: bool = False


class TwoRegions:
    """The two, the robot and the radio between all of them."""

    #: Share of rounds in which either region crashes, and of handovers at one of whose steps one or both do.
    crashes, at_steps = 0.0, 0.5

    def __init__(self, seed: int, region: type[Region] = Region, robot: Callable[[], Robot] = Robot) -> None:
        self.rng = np.random.default_rng(seed)
        self._make, self.robot = region, robot()
        self.round, self._sent, self._lives = 0, 0, 0
        self._ways: list[Way] = []
        self._down = [0, 0]
        self.regions: list[Region | None] = [self._born(0), self._born(1)]
        self._gives_at = 0
        self.course = Course()
        self._owned, self._stands, self._crash_at = -1, 0, ""
        self._owner_sent = self._new_owner = False
        self._plan = self.robot.plan

    def _born(self, region: int) -> Region:
        self._lives += 1
        started_s = (self.round * ROUND_TICKS - 1) / 100.0
        return self._make(
            RegionLife(region, self._lives),
            started_s,
            PLACES._replace(neighbours=frozenset((1 - region,))),
            (ROBOT,),
            lambda robot, plan: (),
        )

    def _send(self, to: int, message: Letter | ToRobot | OwnedState) -> None:
        copies = 0 if self.rng.random() < LOST else 1 + (self.rng.random() < DOUBLED)
        for _ in range(copies):
            self._sent += 1
            insort(
                self._ways,
                Way(self.round + int(self.rng.integers(LATE_ROUNDS)), self._sent, to, message),
                key=attrgetter("at"),
            )

    def run(self, handovers: int, most_rounds: int) -> Course:
        """Go on until so many handovers, at most so many rounds for each."""
        last, at = 0, 0
        while self.course.handovers < handovers:
            self.turn()
            if self.course.handovers > last:
                last, at = self.course.handovers, self.round
            if self.round - at > most_rounds:
                self.course.never = True
                break
        return self.course

    def turn(self) -> None:
        """Let a round pass."""
        self.round += 1
        tick = self.round * ROUND_TICKS
        while self._ways and self._ways[0].at <= self.round:
            self._deliver(self._ways.pop(0), tick)
        self._crash()
        for region in self.regions:
            if region is not None:
                self._act(region, tick)
        report = self.robot.report(tick)
        for to in (0, 1):
            self._send(to, report)
        self._look(report, tick)
        self._crash()
        self._wake()

    def _deliver(self, way: Way, tick: int) -> None:
        if way.to < 0:
            assert isinstance(way.message, OwnerOrder | PlanOrder)
            self.robot.receive(way.message, tick)
        elif (region := self.regions[way.to]) is not None:
            if isinstance(way.message, OwnedState):
                region.hear(way.message)
            elif isinstance(way.message, Letter):
                for answer in region.receive(way.message):
                    self._send(answer.to, answer)

    def _act(self, region: Region, tick: int) -> None:
        region.withdraw_late((tick + HOPELESS * ROUND_TICKS) / 100.0)
        if region.free(ROBOT):
            if self.round >= self._gives_at:
                region.offer(ROBOT, 1 - region.name.region)
            samples = np.zeros((2 * (LEAD + DRIVE + BRAKE) + 1, COLUMNS))
            region.propose(ROBOT, TimedPlan(samples, tick / 100.0, (tick + LEAD * ROUND_TICKS) / 100.0))
        for letter in region.letters():
            self._send(letter.to, letter)
        for order in region.orders():
            self._owner_sent = self._owner_sent or (
                isinstance(order, OwnerOrder) and order.owner.region == 1 - self._owned
            )
            self._send(-1, order)

    def _look(self, report: OwnedState, tick: int) -> None:
        for region in self.regions:
            if region is not None and region.ready:
                own, foreign = region.own.get(ROBOT), region.foreign.get(ROBOT)
                held = [*(own.claims if own else {}).values(), *(foreign.plans if foreign else {}).values()]
                self.course.astray += all(plan is not report.plan for plan in held)
        if report.owner is not None and report.owner.region != self._owned:
            self.course.handovers += self._owned >= 0
            self._owned = report.owner.region
            self._gives_at = self.round + int(self.rng.integers(10, 40))
            self._crash_at = str(self.rng.choice(STEPS)) if self.rng.random() < self.at_steps else ""
            self._owner_sent, self._new_owner = False, self._owned >= 0
        self._new_owner = self._new_owner and report.plan is self._plan
        self._plan = report.plan
        if self.robot.stands(tick):
            self._stands += 1
        elif self._stands:
            self.course.stood.append(self._stands)
            self._stands = 0

    def _step(self) -> str:
        """Last step of the handover under way; "" if there is none."""
        if self._owned < 0:
            return ""
        giver = self.regions[self._owned]
        own = giver.own.get(ROBOT) if giver is not None else None
        if self._new_owner:
            return "planned" if own is not None else "fenced"
        if own is None or own.offered is None:
            return ""
        if own.heir is None:
            return "offered"
        return "owner sent" if self._owner_sent else "accepted"

    def _wake(self) -> None:
        for which, region in enumerate(self.regions):
            if region is None:
                self._down[which] -= 1
                if self._down[which] <= 0:
                    self.regions[which] = self._born(which)

    def _crash(self) -> None:
        """Crash a region: now and then either, and one or both at the chosen step of some handovers."""
        step = self._step()
        at_step = step != "" and step == self._crash_at and self.rng.random() < 0.5
        victims = [(0,), (1,), (0, 1)][self.rng.integers(3)] if at_step else ()
        for which in (0, 1):
            if self.regions[which] is not None and (which in victims or self.rng.random() < self.crashes):
                self.course.crashes[step] += 1
                self.regions[which], self._down[which] = None, int(self.rng.integers(1, 11))
        self._crash_at = "" if at_step else self._crash_at
