"""Random answers of algorithms: a wrong one stops its robot and is told; no other robot notices, and nothing fails."""

from __future__ import annotations

import json
import math
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from functools import cache
from typing import Any, NoReturn

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fleet.test_committed_plans import LIMITS
from touchline.coordination.algorithms import asking
from touchline.coordination.algorithms.algorithm_task import AlgorithmTask
from touchline.coordination.algorithms.deciders import CentralDecider, Decider, RobotDeciders
from touchline.coordination.algorithms.peer_radio import PeerRadio
from touchline.coordination.algorithms.wish_figures import wish_figures
from touchline.coordination.free_area import FreeArea
from touchline.coordination.hub import Hub
from touchline.coordination.interventions import Interventions
from touchline.coordination.plans.plan_hub import PlanHub, PlanSettings
from touchline.coordination.tasks import GoalLists
from touchline.schemas.messages import Guidance, PlanState, Whereabouts
from touchline.schemas.team import TeamRadio, TeamScenario
from touchline.team_algorithms import HOLD, GoalWish, Me, PathWish, Team, TwistWish, VelocityWish

pytestmark = pytest.mark.xdist_group("team")
UPDATES = 4
ROOM = FreeArea.of([(0, 0), (12, 0), (12, 12), (0, 12)])
PLACES = {"a": (2.0, 2.0), "b": (10.0, 10.0)}
TEAM = TeamScenario.model_validate(
    {"places": {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in PLACES.items()}}
)
STEADY = VelocityWish(-0.3, 0.0)
EXAMPLES = int(os.environ.get("TOUCHLINE_WRONG_ANSWERS", "60"))
"""Examples of each test."""


class Nasty:
    """Fails whatever is asked of it."""

    def _fail(self, *_: Any) -> NoReturn:
        raise ZeroDivisionError

    __float__ = __repr__ = __str__ = __len__ = __iter__ = __getitem__ = __hash__ = __eq__ = _fail  # type: ignore[assignment]


class Mute(Exception):
    """Exception without a text."""

    def __str__(self) -> str:
        raise ValueError


class Clock:
    """Clock by which answers are late."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


CLOCK = Clock()


class Failing:
    """Rule that raises an exception."""

    def __init__(self, kind: type[BaseException]) -> None:
        self._kind = kind

    def __call__(self) -> NoReturn:
        raise self._kind("on purpose")


def late() -> Any:
    CLOCK.now_s += 1.0
    return VelocityWish(0.1, 0.0)


ODD = (
    10**400,
    -(10**18),
    Decimal("NaN"),
    1j,
    math.nan,
    math.inf,
    1e308,
    -1.7e308,
    np.float32(0.1),
    object,
    "",
)
NUMBERS = (
    st.floats()
    | st.integers()
    | st.booleans()
    | st.none()
    | st.text(max_size=3)
    | st.sampled_from(ODD)
    | st.builds(Nasty)
)
ARRAYS = st.builds(np.zeros, st.sampled_from([(), (0,), (2,), (2, 2), (1, 3), (3, 2, 2)]))
ANYTHING: st.SearchStrategy[Any] = st.recursive(
    NUMBERS | ARRAYS | st.binary(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.tuples(inner, inner)
        | st.dictionaries(st.text(max_size=2), inner, max_size=2)
        | st.builds(VelocityWish, inner, inner)
        | st.builds(TwistWish, inner, inner)
        | st.builds(GoalWish, inner, inner)
        | st.builds(PathWish, inner)
    ),
    max_leaves=6,
)
FLOATS = st.floats() | st.sampled_from([1e300, -1e300, 40.0, -3.0, 6.0])
WISHES = (
    st.builds(VelocityWish, FLOATS, FLOATS)
    | st.builds(TwistWish, FLOATS, FLOATS)
    | st.builds(GoalWish, FLOATS, FLOATS)
    | st.builds(PathWish, st.lists(st.tuples(FLOATS, FLOATS), max_size=4))
)
FAILING = st.sampled_from([ValueError, KeyError, MemoryError, RecursionError, SystemExit, StopIteration, Mute]).map(
    Failing
)
RULES = (ANYTHING | WISHES).map(lambda answer: lambda: answer) | FAILING | st.just(late)


class ForAll:
    """One algorithm for both robots."""

    def __init__(self, rule: Callable[[], Any]) -> None:
        self._rule = rule

    def decide(self, now: Team) -> dict[str, Any]:
        return {"b": STEADY, "a": self._rule()}


class Whole(ForAll):
    """One algorithm, whose whole answer is wrong."""

    def decide(self, now: Team) -> dict[str, Any]:
        found: dict[str, Any] = self._rule()
        return found


class ForEach:
    """Algorithm of each robot; that of `a` may send anything, too."""

    def __init__(self, rule: Callable[[], Any], message: Any) -> None:
        self._rule, self._message = rule, message

    def start(self, me: Me) -> None:
        """Begin."""

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        """Take a message."""

    def decide(self, me: Me) -> Any:
        return (self._rule(), self._message) if me.name == "a" else (STEADY, None)


class Loose(ForEach):
    """Algorithm of each robot; that of `a` does not even answer with a pair."""

    def decide(self, me: Me) -> Any:
        return self._rule() if me.name == "a" else (STEADY, None)


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(asking, "perf_counter", CLOCK)
    yield


def for_each(make: Callable[[], Any]) -> Decider:
    return RobotDeciders(make, PeerRadio(TeamRadio(range_m=20.0), TEAM.number_of, ROOM, 0, 0.4))


def guided(decider: Decider, avoid: str) -> tuple[dict[str, Guidance], AlgorithmTask]:
    """Messages of a coordinator to two robots that are far from each other, after some updates."""
    task = AlgorithmTask(TEAM, ROOM, GoalLists({}), decider)
    hub: Hub | PlanHub
    if avoid == "plans":
        states = {name: PlanState(x_m=x, y_m=y) for name, (x, y) in PLACES.items()}
        hub = PlanHub(ROOM, task, states, 0.0, PlanSettings(LIMITS, 0.0, 0.02, certain=True, avoid="plans"))
    else:
        stand = {
            name: Whereabouts(x_m=x, y_m=y, stop_x_m=x, stop_y_m=y, aligned=True) for name, (x, y) in PLACES.items()
        }
        hub = Hub(ROOM, task, stand)
    for update in range(UPDATES):
        hub.update(0.2 * update)
    return hub.guidance(), task


def same(one: Guidance, other: Guidance) -> bool:
    return all(
        np.array_equal(np.array(value), np.array(getattr(other, field)))
        for field, value in one.model_dump().items()
        if field in ("target_x_m", "target_y_m", "plan", "half_planes")
    )


@cache
def if_it_holds(avoid: str) -> dict[str, Guidance]:
    return guided(CentralDecider(ForAll(lambda: HOLD)), avoid)[0]


def check(make: Callable[[], Decider], rule: Callable[[], Any]) -> None:
    for avoid in ("plans", "cells"):
        found, task = guided(make(), avoid)
        book, held = task.decider.books["a"], if_it_holds(avoid)
        assert same(found["b"], held["b"])
        assert not task.decider.books["b"].counts
        if rule is late:
            assert book.counts["late"] >= UPDATES - 2  # the first answer may take as long as it needs
        elif set(book.counts) - {"too-fast"}:
            assert same(found["a"], held["a"])
            assert book.dismissed
        assert bool(book.counts) == bool(book.first)
        json.dumps(wish_figures(task, Interventions()), allow_nan=False)


def test_an_algorithm_that_does_not_end_stops_its_robot_and_nobody_waits_for_it() -> None:
    goes_on, asked = threading.Event(), list[float]()

    def stuck() -> VelocityWish:
        asked.append(CLOCK.now_s)
        if len(asked) > 1:
            CLOCK.now_s += 1.0
            goes_on.wait()
        return STEADY

    decider = for_each(lambda: ForEach(stuck, None))
    task, states = AlgorithmTask(TEAM, ROOM, GoalLists({}), decider), np.zeros((2, 4))
    assert task.wishes(("a", "b"), states) == {"a": STEADY, "b": STEADY}
    for _ in range(2):
        assert task.wishes(("a", "b"), states) == {"a": HOLD, "b": STEADY}
    assert len(asked) == 2, "it is asked nothing before it has ended"
    assert decider.books["a"].counts == {"late": 2}
    assert not decider.books["b"].counts
    goes_on.set()


QUICK = settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))


@given(RULES)
@QUICK
def test_a_wrong_wish_of_one_algorithm_for_all_stops_one_robot(rule: Callable[[], Any]) -> None:
    if rule is late or isinstance(rule, Failing):
        return  # stops all: the next test
    check(lambda: CentralDecider(ForAll(rule)), rule)


@given(RULES)
@QUICK
def test_whatever_one_algorithm_for_all_answers_nothing_fails(rule: Callable[[], Any]) -> None:
    found, task = guided(CentralDecider(Whole(rule)), "plans")
    assert set(found) == {"a", "b"}
    assert (task.decider.books["a"].counts == task.decider.books["b"].counts) or isinstance(rule(), Mapping)
    json.dumps(wish_figures(task, Interventions()), allow_nan=False)


@given(RULES, st.none() | st.binary(max_size=3) | st.just(b"x" * 1025) | ANYTHING)
@QUICK
def test_a_wrong_answer_of_a_robots_algorithm_stops_that_robot(rule: Callable[[], Any], message: Any) -> None:
    check(lambda: for_each(lambda: ForEach(rule, message)), rule)


@given(RULES)
@QUICK
def test_an_answer_of_a_robots_algorithm_that_is_no_pair_stops_that_robot(rule: Callable[[], Any]) -> None:
    check(lambda: for_each(lambda: Loose(rule, None)), rule)
