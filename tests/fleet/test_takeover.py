"""A standby takes over by what robots say, while half of all messages are lost and the former coordinator goes on."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.fleet.teams import FOUL, TEAM_LIMITS, Team, on_circle, seeds, square, swapped
from tests.fleet.test_committed_plans import LIMITS, scattered
from tests.fleet.test_links import nearest_cells_m
from tests.fleet.test_plan_hub import OPEN, ROUNDING_M, SETTINGS, Robots
from tests.with_full import with_full
from touchline.bus import Bus, BusConfig
from touchline.coordination.hub import Hub
from touchline.coordination.plans.plan_hub import FollowedPlan, PlanHub
from touchline.coordination.tasks import GoalLists
from touchline.core.timed_motion import COLUMNS
from touchline.onboard.executive.cell_keeper import CellKeeper
from touchline.onboard.executive.owner_fence import OwnerFence
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import PlanState
from touchline.schemas.messages.team_messages import TeamCell
from touchline.schemas.team import GoalsTask, SwapTask
from touchline.services.coordinator.succession import Replaced, Succession
from touchline.services.coordinator.team_memory import remaining_task

NAMES = [f"tb{number:02}" for number in range(10)]


class Coordinator(NamedTuple):
    """A hub, and what its messages carry."""

    name: str
    epoch: int
    hub: PlanHub


class Run:
    """Robots, and coordinators that follow each other; the former ones go on sending."""

    def __init__(self, seed: int, *, fenced: bool) -> None:
        self.rng, self._fenced = np.random.default_rng(seed), fenced
        poses = scattered(self.rng, len(NAMES)).tolist()
        self.starts = {
            n: PlanState(x_m=x, y_m=y, heading_rad=turn) for n, (x, y, turn) in zip(NAMES, poses, strict=True)
        }
        self.robots = Robots(self.starts)
        self.fences = {name: OwnerFence("0", 1) for name in NAMES}
        self.coordinators = [Coordinator("0", 1, PlanHub(OPEN, self._goals(), self.starts, 0.0, SETTINGS))]
        self._letters: list[tuple[int, str, Coordinator, Any]] = []
        self.closest_m, self.moved_m = np.inf, 0.0
        self._before: Any = None
        self._answers: dict[str, FollowedPlan] = {}

    def _goals(self) -> GoalLists:
        goals = self.rng.uniform((0.3, 0.3), (4.7, 3.7), (len(NAMES), 9, 2)).tolist()
        return GoalLists(dict(zip(NAMES, goals, strict=True)))

    def run(self, ticks: int, takeovers: tuple[int, ...]) -> None:
        """At each of some ticks a coordinator is lost: the next one asks the robots, in turn, and begins then."""
        for tick in range(0, ticks, 5):
            self._drive(tick)
            lost = [each for each in takeovers if each <= tick]
            if len(lost) >= len(self.coordinators):
                self._ask(tick)
            self._deliver(tick)
            for each in self.coordinators:
                if tick % 40 == 0:
                    each.hub.update(tick / 100.0)
                self._send(tick, each)

    def _drive(self, tick: int) -> None:
        now = self.robots.states(tick).values()
        places = np.array([complex(each.x_m, each.y_m) for each in now])
        apart = np.abs(places[:, None] - places) + np.diag(np.full(len(NAMES), np.inf))
        self.closest_m = min(self.closest_m, float(apart.min()))
        self.moved_m += 0.0 if self._before is None else float(np.abs(places - self._before).sum())
        self._before = places

    def _ask(self, tick: int) -> None:
        """Take the answer of some robots; once all have answered, the standby coordinates."""
        epoch = len(self.coordinators) + 1
        for name in NAMES:
            if name not in self._answers and self.rng.random() < 0.1:
                keeper = self.robots.keepers[name]
                if self._fenced:
                    self.fences[name].take(str(epoch), epoch)
                state = self.robots.states(tick)[name]
                self._answers[name] = FollowedPlan(state, keeper.plan.reshape(-1, COLUMNS), keeper.plan_tick / 100.0)
        if len(self._answers) == len(NAMES) and tick % 40 == 0:
            hub = PlanHub(OPEN, self._goals(), self._answers, tick / 100.0 - 0.4, SETTINGS)
            self.coordinators.append(Coordinator(str(epoch), epoch, hub))
            self._answers = {}

    def _deliver(self, tick: int) -> None:
        due = [letter for letter in self._letters if letter[0] <= tick]
        self._letters = [letter for letter in self._letters if letter[0] > tick]
        for _, name, coordinator, message in due:
            if isinstance(message, PlanState):
                coordinator.hub.receive(name, message, tick / 100.0)
            elif not self._fenced or self.fences[name].obeys(*self._owner(coordinator)):
                self.robots.keepers[name].receive(message, tick)

    def _owner(self, coordinator: Coordinator) -> tuple[str, int]:
        return coordinator.name, coordinator.epoch

    def _send(self, tick: int, coordinator: Coordinator) -> None:
        if tick % 10:
            return
        for name, message in [*self.robots.states(tick).items(), *coordinator.hub.guidance().items()]:
            for _ in range(int(self.rng.choice([0, 1, 2], p=[0.5, 0.4, 0.1]))):
                self._letters.append((tick + int(self.rng.integers(0, 80)), name, coordinator, message))


@pytest.mark.parametrize("seed", with_full(1, full=range(2, 20)))
def test_no_two_robots_meet_while_coordinators_take_over_and_former_ones_go_on(seed: int) -> None:
    run = Run(seed, fenced=True)
    run.run(2400, takeovers=(600, 1400))
    assert len(run.coordinators) == 3
    assert run.closest_m >= LIMITS.apart_m - ROUNDING_M
    assert run.moved_m > 20.0


def test_without_the_fence_former_coordinators_lead_robots_into_others() -> None:
    run = Run(4, fenced=False)
    run.run(2400, takeovers=(600, 1400))
    assert run.closest_m < LIMITS.apart_m - ROUNDING_M


class TeamInCells(Team):
    """A team by cells whose coordinator is lost while all drive, and goes on sending; robots answer one by one."""

    def __init__(self, seed: int, *, forgets: bool) -> None:
        states, self._area, self._forgets = on_circle(8, 1.5, 2.5, seed), square(5.0), forgets
        self._goals, _ = swapped(states)
        self._answered = dict[str, float]()
        self._first = dict[str, m.Whereabouts]()
        self.taken_over_s = np.inf
        super().__init__(states, self._area, self._goals, FOUL, seed)

    def apart_m(self, until_s: float) -> float:
        """Least distance of two robots' cells at any time."""
        nearest_m = np.inf
        while self.now_s < until_s:
            self.run(self.now_s + 0.1)
            nearest_m = min(nearest_m, nearest_cells_m(self))
        return nearest_m

    def _exchange(self, frozen: set[str]) -> None:
        if 6.0 <= self.now_s < self.taken_over_s:
            self._take_over()
        super()._exchange(frozen)

    def _take_over(self) -> None:
        for name in self.names:
            if name not in self._answered and self.rng.random() < 0.1:
                self._answered[name], former = self.now_s, self.keepers[name]
                self.keepers[name] = CellKeeper(TEAM_LIMITS)
                if not self._forgets:
                    self.keepers[name].half_planes, self.keepers[name].until_s = former.half_planes, former.until_s
                self.to_robots = [letter for letter in self.to_robots if letter.name != name]
                self._aim()
        for at_s, name, message in self.to_hub:
            if at_s <= self.now_s and message.stamp_s > self._answered.get(name, np.inf):
                self._first[name] = message
        if len(self._first) == len(self.names):
            self.hub, self.taken_over_s = Hub(self._area, self._goals, self._first, self.now_s), self.now_s

    def _post(self, box: Any, name: str, message: Any) -> None:
        refused = box is self.to_robots and name in self._answered and self.taken_over_s == np.inf
        if not refused:
            super()._post(box, name, message)


@seeds(10)
def test_no_two_robots_in_cells_meet_while_another_coordinator_takes_over(seed: int) -> None:
    team = TeamInCells(seed, forgets=True)
    assert team.apart_m(until_s=15.0) >= LIMITS.apart_m - 1e-9
    assert team.taken_over_s < 12.0
    assert team.closest_m >= LIMITS.apart_m - 1e-6


def test_cells_that_robots_kept_would_lie_in_new_ones() -> None:
    assert TeamInCells(1, forgets=False).apart_m(until_s=15.0) < LIMITS.apart_m - 0.1


def test_what_is_left_of_a_task_is_what_its_coordinator_published_last() -> None:
    cells = [TeamCell(name="a", goal_x_m=2.0, goal_y_m=3.0), TeamCell(name="b", goal_x_m=1.0)]
    given = GoalsTask(kind="goals", goals={"a": ((1.0, 1.0), (2.0, 3.0), (4.0, 4.0))})
    assert remaining_task(given, cells).model_dump()["goals"] == {
        "a": ((2.0, 3.0), (4.0, 4.0)),
        "b": ((1.0, 0.0),),
    }
    assert remaining_task(SwapTask(kind="swap"), cells).model_dump()["goals"] == {
        "a": ((2.0, 3.0),),
        "b": ((1.0, 0.0),),
    }
    assert remaining_task(SwapTask(kind="swap"), []).kind == "swap"


def test_a_coordinator_whose_robot_obeys_another_ends(bus_config: BusConfig) -> None:
    with Bus.open(topics.COORDINATOR, bus_config) as bus:
        look = Succession(bus, {})
        look._look_at("a", encode(m.SetOwnerResponse(coordinator=bus.session_id)))
        look._look_at("a", None)
        with pytest.raises(Replaced, match="another coordinator has taken over: a says that session 12 guides it"):
            look._look_at("a", encode(m.SetOwnerResponse(coordinator="12", message="session 12 guides it")))
