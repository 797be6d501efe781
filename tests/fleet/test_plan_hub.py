"""Plans over a bad radio: whatever is lost, late, doubled or overtaken, no robot is where others do not keep off."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from tests.fleet.test_committed_plans import LIMITS, ROOM, at_nearest, scattered
from tests.with_full import with_full
from touchline.coordination.dispatch import insertion_kernels
from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans import plan_kernels
from touchline.coordination.plans.barrier_plans import BarrierPlans
from touchline.coordination.plans.committed_plans import CommittedPlans
from touchline.coordination.plans.plan_hub import OffPlan, PlanHub, PlanSettings
from touchline.coordination.tasks import GoalLists
from touchline.core import timed_motion as t
from touchline.core.kernel_calls import MISS
from touchline.onboard.executive.plan_keeper import PlanKeeper
from touchline.schemas.messages import Guidance, PlanState
from touchline.schemas.team import TeamScenario
from touchline.services.coordinator.warm_up_team import warm_up_team

LOSSY = LIMITS._replace(lead_steps=12, drive_steps=12)
SETTINGS = PlanSettings(LOSSY, lag_s=0.0, margin_m=0.02, certain=False, avoid="plans")
OPEN = FreeArea.of([(0, 0), (5, 0), (5, 4), (0, 4)])
ROUNDING_M = 1e-9


class Robots:
    """Robots that follow their plans exactly."""

    def __init__(self, starts: dict[str, PlanState]) -> None:
        self.starts = starts
        self.keepers = {name: PlanKeeper() for name in starts}

    def states(self, tick: int) -> dict[str, PlanState]:
        return {name: self._state(name, tick) for name in self.starts}

    def _state(self, name: str, tick: int) -> PlanState:
        keeper, now = self.keepers[name], np.zeros(t.COLUMNS)
        start = self.starts[name]
        now[:3] = start.x_m, start.y_m, start.heading_rad
        if len(keeper.plan):
            t.motion_at(keeper.plan, (tick - keeper.plan_tick) / 100.0, now)
        x, y, heading, speed, rate = now.tolist()
        numbers = {"adopted": keeper.adopted, "decided": keeper.decided}
        motion = {"x_m": x, "y_m": y, "heading_rad": heading, "speed_mps": speed, "yaw_rate_radps": rate}
        return PlanState(stamp_s=tick / 100.0, **motion, **numbers)


@pytest.mark.parametrize(
    ("avoid", "seed"),
    with_full(
        ("plans", 0), ("plans", 1), ("barriers", 0), full=[*(("plans", k) for k in range(2, 6)), ("barriers", 1)]
    ),
)
def test_no_two_robots_meet_when_half_of_all_messages_are_lost(avoid: Literal["plans", "barriers"], seed: int) -> None:
    rng = np.random.default_rng(seed)
    names = [f"tb{number:02}" for number in range(10)]
    poses = scattered(rng, len(names)).tolist()
    starts = {name: PlanState(x_m=x, y_m=y, heading_rad=turn) for name, (x, y, turn) in zip(names, poses, strict=True)}
    goals = rng.uniform((0.3, 0.3), (4.7, 3.7), (len(names), 6, 2)).tolist()
    hub = PlanHub(OPEN, GoalLists(dict(zip(names, goals, strict=True))), starts, 0.0, replace(SETTINGS, avoid=avoid))
    robots, letters, driven_m = Robots(starts), list[tuple[int, str, Any]](), 0.0
    before = None
    for tick in range(0, 3000, 5):
        now = robots.states(tick)
        places = np.array([complex(each.x_m, each.y_m) for each in now.values()])
        apart = np.abs(places[:, None] - places) + np.diag(np.full(len(names), np.inf))
        assert apart.min() >= LIMITS.apart_m - ROUNDING_M, tick
        driven_m += 0.0 if before is None else float(np.abs(places - before).sum())
        before = places
        due = [letter for letter in letters if letter[0] <= tick]
        letters = [letter for letter in letters if letter[0] > tick]
        for _, name, message in due:
            if isinstance(message, PlanState):
                hub.receive(name, message, tick / 100.0)
            else:
                robots.keepers[name].receive(message, tick)
        if tick % 40 == 0:
            hub.update(tick / 100.0)
        for name, message in [*now.items(), *hub.guidance().items()] if tick % 10 == 0 else ():
            for _ in range(int(rng.choice([0, 1, 2], p=[0.5, 0.4, 0.1]))):
                letters.append((tick + int(rng.integers(0, 80)), name, message))
    assert driven_m > 20.0
    assert hub.nearest_m >= LIMITS.apart_m - ROUNDING_M


@pytest.mark.parametrize("kind", [CommittedPlans, BarrierPlans])
def test_proposals_keep_clear_of_both_plans_of_others(kind: type[CommittedPlans]) -> None:
    rng = np.random.default_rng(5)
    team = kind(scattered(rng, 12), ROOM, LOSSY, certain=False)
    offers = 0
    for _ in range(60):
        team.choose_by(at_nearest(team.places), rng.permutation(12).tolist())
        assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
        offers += int(team.proposed.sum())
        for who in np.flatnonzero(team.proposed).tolist():
            if rng.uniform() < 0.5:
                team.settle(who, follows=bool(rng.integers(2)))
    assert offers > 100


def plan_message(number: int, base: int, branch_s: float = 1.0) -> Guidance:
    plan = np.zeros((10, t.COLUMNS))
    plan[:, t.X] = np.minimum(np.arange(10), 5) * 0.01
    return Guidance(number=number, plan=plan.ravel(), plan_start_s=0.5, plan_branch_s=branch_s, plan_base=base)


def test_a_robot_follows_a_plan_that_continues_its_own_and_comes_in_time() -> None:
    keeper = PlanKeeper()
    assert keeper.receive(plan_message(3, 0), 100)
    assert (keeper.adopted, keeper.decided, keeper.plan_tick) == (3, 3, 50)
    assert keeper.receive(plan_message(2, 3), 100)  # overtaken
    assert (keeper.adopted, keeper.decided) == (3, 3)
    assert keeper.receive(plan_message(4, 3), 101)  # too late
    assert (keeper.adopted, keeper.decided) == (3, 4)
    assert keeper.receive(plan_message(4, 3, branch_s=9.0), 101)  # refused for ever
    assert (keeper.adopted, keeper.decided) == (3, 4)
    assert keeper.receive(plan_message(5, 4, branch_s=9.0), 101)  # continues another
    assert (keeper.adopted, keeper.decided) == (3, 5)
    assert keeper.receive(plan_message(6, 3, branch_s=9.0), 101)
    assert (keeper.adopted, keeper.decided) == (6, 6)
    assert not keeper.over(99)
    assert keeper.over(100)  # ten samples of 0.05 s from 0.5 s on
    assert keeper.receive(plan_message(7, 6, branch_s=9.0), 101, halts=True)  # it is to stand
    assert (keeper.adopted, keeper.decided) == (6, 7)


@pytest.mark.parametrize(
    "plan",
    [[], [0.0] * 5, [0.0] * 12, [math.nan] * 10, [0.0] * 8 + [0.1, 0.0], [0.0] * 9 + [0.1]],
    ids=["none", "one sample", "no samples", "not finite", "ends driving", "ends turning"],
)
def test_a_robot_passes_over_what_is_no_plan(plan: list[float]) -> None:
    keeper = PlanKeeper()
    assert not keeper.receive(Guidance(number=1, plan=np.array(plan)), 0)
    assert (keeper.adopted, keeper.decided, len(keeper.plan)) == (0, 0, 0)


def certain_pair() -> tuple[PlanHub, Robots]:
    """Two robots that follow the plans that they were sent for certain, 0.4 s ago."""
    starts = {"a": PlanState(x_m=0.5, y_m=0.5), "b": PlanState(x_m=0.5, y_m=3.0)}
    certain = PlanSettings(LIMITS, lag_s=0.0, margin_m=0.02, certain=True, avoid="plans")
    hub = PlanHub(ROOM, GoalLists({"a": [(1.5, 0.5)], "b": [(1.5, 3.0)]}), starts, 0.0, certain)
    hub.update(0.0)
    robots = Robots(starts)
    for name, message in hub.guidance().items():
        robots.keepers[name].receive(message, 0)
    return hub, robots


def test_a_robot_that_is_not_heard_keeps_the_plan_that_it_follows_for_certain() -> None:
    hub, robots = certain_pair()
    hub.receive("a", robots.states(40)["a"], 0.4)
    before = hub.guidance()
    hub.update(0.4)
    assert {name for name, each in hub.guidance().items() if each.number > before[name].number} == {"a"}
    hub.receive("b", robots.states(40)["b"], 0.7)
    hub.receive("b", robots.states(80)["b"], 0.8)
    hub.update(0.8)
    assert hub.guidance()["b"].plan_base == before["b"].number


@pytest.mark.parametrize("avoid", ["plans", "barriers"])
def test_a_robot_that_stays_is_sent_no_plan_and_nobody_makes_way_for_it(avoid: Literal["plans", "barriers"]) -> None:
    starts = {"a": PlanState(x_m=0.5, y_m=0.5), "b": PlanState(x_m=0.5, y_m=3.0)}
    goals = GoalLists({"a": [(4.5, 0.5)], "b": [(4.5, 3.0)]})
    hub, robots = PlanHub(OPEN, goals, starts, 0.0, replace(SETTINGS, avoid=avoid)), Robots(starts)
    numbers = []
    for tick in range(0, 1000, 40):
        for name, state in robots.states(tick).items():
            told = {"stays": name == "a" and 120 <= tick < 800}
            hub.receive(name, state.model_copy(update=told), tick / 100.0)
        hub.update(tick / 100.0)
        assert "a" not in hub.stuck
        numbers.append({name: each.number for name, each in hub.guidance().items()})
        for name, message in hub.guidance().items():
            robots.keepers[name].receive(message, tick)
    stays = [numbers[tick // 40]["a"] for tick in range(120, 800, 40)]
    assert len(set(stays)) == 1
    assert numbers[120 // 40 - 1]["a"] == stays[0] < numbers[800 // 40]["a"]
    assert numbers[3]["b"] < numbers[5]["b"]


def test_a_robot_that_has_missed_a_plan_is_named() -> None:
    hub, robots = certain_pair()
    robots.keepers["b"] = PlanKeeper()
    for name, state in robots.states(40).items():
        hub.receive(name, state, 0.4)
    with pytest.raises(OffPlan, match=r"robot b has missed its plan, and follows an older one"):
        hub.update(0.4)


def test_a_robot_off_its_plan_is_named() -> None:
    hub, robots = certain_pair()
    states = robots.states(40)
    hub.receive("a", states["a"], 0.4)
    hub.receive("b", states["b"].model_copy(update={"y_m": 3.03}), 0.4)
    with pytest.raises(OffPlan, match=r"robot b is 0\.030 m off its plan"):
        hub.update(0.4)
    assert hub.outside_m["a"] < 1e-3


def test_a_robot_that_refuses_its_plan_is_named_where_every_plan_counts_as_followed() -> None:
    certain = PlanSettings(LIMITS, lag_s=0.0, margin_m=0.02, certain=True, avoid="plans")
    hub = PlanHub(ROOM, GoalLists({"a": [(1.5, 0.5)]}), {"a": PlanState(x_m=0.5, y_m=0.5)}, 0.0, certain)
    hub.update(0.0)
    number = hub.guidance()["a"].number
    hub.receive("a", PlanState(stamp_s=0.4, x_m=0.5, y_m=0.5, decided=number), 0.4)
    with pytest.raises(OffPlan, match="robot a has refused its plan"):
        hub.update(0.4)


def test_a_coordinator_has_prepared_what_it_seldom_needs_before_robots_wait_for_it() -> None:
    seldom = (plan_kernels.blocker, insertion_kernels.task_wh, insertion_kernels.left_wh)
    with pytest.MonkeyPatch.context() as anew:
        for each in seldom:
            anew.setattr(each, "prepared", {})
            anew.setattr(each, "_recent", lambda *_: MISS)
        warm_up_team(TeamScenario(avoid="plans"), FreeArea.of([(0, 0), (8, 0), (8, 8), (0, 8)]))
        assert all(each.prepared for each in seldom)
