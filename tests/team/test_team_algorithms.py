"""Algorithms of users: any wish, any answer and any radio; what keeps robots apart does so whatever they wish."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest

from touchline.coordination.algorithms.answers import WrongAnswer, checked_message
from touchline.coordination.algorithms.peer_radio import PeerRadio
from touchline.coordination.free_area import FreeArea
from touchline.coordination.start_poses import free_area
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.errors import SpecError
from touchline.schemas.plugins import TEAM_ALGORITHMS
from touchline.schemas.team import AlgorithmChoice, TeamRadio, TeamScenario
from touchline.services.coordinator.warm_up_team import warm_up_team
from touchline.team_algorithms import (
    HOLD,
    GoalWish,
    Hold,
    Me,
    Neighbours,
    PathWish,
    Team,
    TwistWish,
    VelocityWish,
    Wish,
)

pytestmark = pytest.mark.xdist_group("team")
AREA = {"outline": [(0, 0), (6, 0), (6, 6), (0, 6)]}
QUIET = {"noise": "none"}
Rule = Callable[[Me], Any]


class Central:
    """Asks a rule for each robot."""

    def __init__(self, rule: Rule) -> None:
        self._rule = rule

    def decide(self, now: Team) -> dict[str, Any]:
        return {name: self._rule(me) for name, me in now.robots.items()}


class Speaking:
    """Wishes nothing, says where it is, and notes what it hears."""

    heard_by: ClassVar[dict[str, list[tuple[str, float]]]] = {}

    def start(self, me: Me) -> None:
        self.name = me.name
        self.heard_by[me.name] = []

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self.heard_by[self.name].append((sender, age_s))

    def decide(self, me: Me) -> tuple[Wish, bytes]:
        return HOLD, b"here"


@pytest.fixture
def offer() -> Iterator[Callable[[Any], str]]:
    """Registers what makes an algorithm; the name that it has then."""

    def register(make: Any) -> str:
        TEAM_ALGORITHMS.register("ours", "of this test", make)
        return "ours"

    yield register
    if TEAM_ALGORITHMS.has("ours"):
        TEAM_ALGORITHMS.forget("ours")


def driven(use: str, avoid: str = "plans", **given: Any) -> tuple[TeamRun, dict[str, Any]]:
    given = {"area": AREA, "world": QUIET, "duration_s": 6.0} | given
    team = TeamScenario.model_validate({"algorithm": {"use": use}, "avoid": avoid, **given})
    run = TeamRun(team, hashed=True)
    run.run()
    return run, team_figures(run, 1.0)


def at(x_m: float, y_m: float, heading_rad: float = 0.0) -> dict[str, float]:
    return {"x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}


@pytest.mark.parametrize("avoid", ["plans", "cells"])
@pytest.mark.parametrize(
    ("wish", "end"),
    [
        (VelocityWish(0.0, 0.2), lambda x, y, turn: abs(x - 2.0) < 0.25 and 2.8 < y < 3.2),
        (GoalWish(3.0, 2.0), lambda x, y, turn: math.hypot(x - 3.0, y - 2.0) < 0.05),
        (PathWish([(2.0, 2.0), (2.5, 2.0), (2.5, 2.5)]), lambda x, y, turn: math.hypot(x - 2.5, y - 2.5) < 0.05),
        (Hold(), lambda x, y, turn: math.hypot(x - 2.0, y - 2.0) < 0.01 and abs(turn) < 0.02),
        (VelocityWish(0.0, 0.0), lambda x, y, turn: math.hypot(x - 2.0, y - 2.0) < 0.01),
    ],
)
def test_a_robot_does_what_is_wished(offer: Any, wish: Wish, end: Any, avoid: str) -> None:
    run, figures = driven(offer(lambda: Central(lambda me: wish)), avoid, places={"a": at(2.0, 2.0)})
    x, y, turn = run.robots["a"].emulator.world.pose[:3]
    assert end(x, y, turn), (x, y, turn)
    assert figures["intervention"]["changed_share"] == 0.0  # nobody is in the way
    assert not figures["algorithm"]["wrong_answers"]


def test_a_twist_turns_on_the_spot_or_drives_a_circle_by_plans(offer: Any) -> None:
    wishes = {"a": TwistWish(0.0, 0.5), "b": TwistWish(0.3, 0.3)}
    use = offer(lambda: Central(lambda me: wishes[me.name]))
    run, _ = driven(use, places={"a": at(1.0, 1.0), "b": at(3.0, 2.0)}, duration_s=5.0)
    a, b = (run.robots[name].emulator.world.pose[:3] for name in "ab")
    assert math.hypot(a[0] - 1.0, a[1] - 1.0) < 0.02
    assert 1.8 < a[2] < 2.8
    assert math.hypot(b[0] - 3.0, b[1] - 3.0) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("avoid", ["plans", "cells"])
def test_whatever_they_wish_robots_do_not_touch(offer: Any, avoid: str) -> None:
    def to_the_wall_through_all(me: Me) -> Wish:
        return VelocityWish(0.5 if me.now_s < 8.0 else -0.5, 0.3 * math.sin(me.now_s + me.x_m))

    use = offer(lambda: Central(to_the_wall_through_all))
    told = {"robots": 8, "world": {"seed": 3}, "duration_s": 16.0}
    run, figures = driven(use, avoid, **told)
    assert figures["contacts"] == 0, figures["reason"]
    assert figures["beyond_walls_robot_s"] == 0.0
    assert figures["intervention"]["changed_share"] > 0.1
    if avoid == "plans":
        assert run.guide.believed.nearest_m >= 0.4 - 1e-9


def test_without_safety_every_wish_is_granted_and_contacts_are_counted(offer: Any) -> None:
    use = offer(lambda: Central(lambda me: GoalWish(3.0, 3.0)))
    _, figures = driven(use, "none", places={"a": at(1.0, 3.0), "b": at(5.0, 3.0, 3.1)}, duration_s=8.0)
    assert figures["contacts"] >= 1
    assert figures["intervention"]["changed_share"] == 0.0


def _raise(me: Me) -> Wish:
    raise RuntimeError("on purpose")


def _sleep(me: Me) -> Wish:
    time.sleep(0.11)
    return VelocityWish(0.2, 0.0)


WRONG: dict[str, tuple[Rule, str]] = {
    "not a number": (lambda me: VelocityWish(math.nan, 0.0), "not-finite"),
    "infinite": (lambda me: PathWish([(math.inf, 0.0)]), "not-finite"),
    "no wish": (lambda me: (0.1, 0.2), "wrong-shape"),
    "nothing": (lambda me: None, "wrong-shape"),
    "no path": (lambda me: PathWish([]), "wrong-shape"),
    "no point": (lambda me: PathWish([(1.0, 2.0, 3.0)]), "wrong-shape"),  # type: ignore[list-item]
    "text": (lambda me: GoalWish("here", "there"), "wrong-shape"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize(("wrong", "code"), WRONG.values(), ids=WRONG)
def test_a_wrong_answer_stops_its_robot_and_no_other(offer: Any, wrong: Rule, code: str) -> None:
    def steady(me: Me) -> Wish:
        return VelocityWish(0.2, 0.0)

    def amiss_later(answer: Rule) -> Rule:
        return lambda me: answer(me) if me.name == "a" and me.now_s >= 1.2 else steady(me)

    told = {"places": {"a": at(1.0, 1.0), "b": at(1.0, 3.0)}, "duration_s": 4.0}
    run, figures = driven(offer(lambda: Central(amiss_later(wrong))), **told)
    TEAM_ALGORITHMS.forget("ours")
    held, _ = driven(offer(lambda: Central(amiss_later(lambda me: HOLD))), **told)
    assert run.hashes == held.hashes  # as if it had wished to hold
    assert run.robots["a"].emulator.world.pose[0] < 1.5 < run.robots["b"].emulator.world.pose[0]
    assert figures["algorithm"]["wrong_answers"]["a"][code] == 3  # nobody asks it any more
    assert figures["algorithm"]["held"] == ["a"]
    assert list(figures["algorithm"]["wrong_answers"]) == ["a"]
    assert figures["reason"].startswith(
        "the algorithm of 1 robots is not asked any more: algorithm.wrong_answers.a: at "
    )
    assert not figures["success"]


@pytest.mark.parametrize(("rule", "code"), [(_raise, "raised"), (_sleep, "late")])
def test_an_algorithm_for_all_that_fails_stops_all(offer: Any, rule: Rule, code: str) -> None:
    told = {"places": {"a": at(1.0, 1.0)}, "update_s": 0.1, "duration_s": 2.0}
    run, figures = driven(offer(lambda: Central(rule)), **told)
    assert run.robots["a"].emulator.world.pose[0] == pytest.approx(1.0, abs=0.01)
    assert figures["algorithm"]["wrong_answers"]["a"][code] >= 19
    assert "first" in figures["algorithm"]["wrong_answers"]["a"]


def test_a_name_that_is_no_robots_stops_all(offer: Any) -> None:
    class Naming:
        def decide(self, now: Team) -> dict[str, Wish]:
            return {"c": HOLD}

    _, figures = driven(offer(Naming), places={"a": at(1.0, 1.0)}, duration_s=1.0)
    assert "'c' is no robot of the team" in figures["algorithm"]["wrong_answers"]["a"]["first"]


def test_a_wish_for_more_than_the_largest_speed_is_granted_up_to_that(offer: Any) -> None:
    run, figures = driven(offer(lambda: Central(lambda me: VelocityWish(9.0, 0.0))), places={"a": at(1.0, 1.0)})
    assert run.trace.driven_m[0] < 0.5 * 6.1
    assert figures["algorithm"]["wrong_answers"]["a"]["too-fast"] >= 15
    assert figures["algorithm"]["held"] == []


def test_robots_hear_those_within_range_and_how_old_it_is(offer: Any) -> None:
    places = {"a": at(1.0, 1.0), "b": at(2.5, 1.0), "c": at(4.6, 1.0)}
    _, figures = driven(offer(Speaking), places=places, radio={"range_m": 2.0}, duration_s=2.0)
    heard = {name: {sender for sender, _ in each} for name, each in Speaking.heard_by.items()}
    assert heard == {"a": {"b"}, "b": {"a"}, "c": set()}
    assert all(age_s == pytest.approx(0.4) for _, age_s in Speaking.heard_by["a"])
    radio = figures["algorithm"]["radio"]
    assert (radio["rounds"], radio["sent"], radio["sent_bytes"]) == (6, 18, 72)
    assert radio["delivered"] == 10  # those of the last round are under way


def test_a_message_that_is_too_long_or_none_is_a_wrong_answer() -> None:
    for payload in (b"x" * 1025, "text", 3):
        with pytest.raises(WrongAnswer):
            checked_message(payload)
    assert checked_message(b"x" * 1024) is not None


WALLED = FreeArea.of([(0, 0), (6, 0), (6, 6), (0, 6)], [[(2.9, 0.0), (3.1, 0.0), (3.1, 5.0), (2.9, 5.0)]])
THREE = {"a": 2 + 1j, "b": 4 + 1j, "c": 2 + 4j}


def hears(radio: TeamRadio, places: dict[str, complex] = THREE, rounds: int = 1, size: int = 1) -> list[set[str]]:
    """Robots that hear b, in each round."""
    connected = PeerRadio(radio, sorted(places).index, WALLED, 1, 0.4)
    found = []
    for number in range(rounds):
        connected.exchange(number * 100.0, {"b": b"x" * size}, places)
        found.append({name for name in places if connected.received(name, number * 100.0 + 90.0)})
    return found


def test_radios_topology() -> None:
    assert hears(TeamRadio(range_m=10.0)) == [{"a", "c"}]
    assert hears(TeamRadio(range_m=10.0, walls=True)) == [set()]
    assert hears(TeamRadio(topology="nearest", nearest=1)) == [{"a"}]
    assert hears(TeamRadio(topology="graph", graph={"b": ("c",)})) == [{"c"}]


def test_another_robot_does_not_change_what_is_lost() -> None:
    lossy = TeamRadio(range_m=10.0, loss=0.5)
    few, many = hears(lossy, rounds=200), hears(lossy, THREE | {"d": 1 + 1j}, rounds=200)
    assert few == [each - {"d"} for each in many]
    assert 150 < sum(map(len, few)) < 250
    assert len({frozenset(each) for each in few}) == 4  # each receiver has its own luck


def test_a_robot_cannot_send_more_than_its_radio_can() -> None:
    heard = hears(TeamRadio(range_m=10.0, bytes_per_s=1000.0), rounds=8, size=1000)
    assert [bool(each) for each in heard] == [True, False, False, True, False, False, True, False]


def test_neighbours_are_known_by_their_newest_message_until_it_is_old() -> None:
    near = Neighbours[str](keep_s=1.0)
    near.note("a", "newer", 0.1)
    near.note("a", "overtaken", 0.5)
    near.note("b", "old", 1.1)
    assert near.known(2.0) == {"a": ("newer", pytest.approx(0.1))}
    near.note("a", "newest", 0.0)
    assert near.known(2.8) == {"a": ("newest", 0.0)}
    assert near.known(3.9) == {}


def test_a_wish_for_a_velocity_is_shortened_to_the_largest_speed() -> None:
    assert VelocityWish.of(3.0 + 4.0j, 0.5) == VelocityWish(pytest.approx(0.3), pytest.approx(0.4))
    assert VelocityWish.of(0.3 - 0.4j, 0.5) == VelocityWish(0.3, -0.4)
    assert VelocityWish.of(0j, 0.5) == VelocityWish(0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "name", "problem"),
    [
        ("", "Mine", "has no class or function 'Mine'"),
        ("raise RuntimeError('no')", "Mine", "cannot be run: RuntimeError: no"),
        ("class Mine: pass", "Mine", "has no `decide`"),
        ("class Mine:\n    def __init__(self, gain): pass\n    def decide(self, now): return {}", "Mine", "gain"),
        ("class Other:\n    def decide(self, now): return {}", "Mine", "Other"),
    ],
)
def test_a_file_without_an_algorithm_is_refused_with_the_reason(
    tmp_path: Path, text: str, name: str, problem: str
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(text)
    with pytest.raises(SpecError, match=problem):
        driven(f"{file}:{name}", places={"a": at(1.0, 1.0)})


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(SpecError, match=r"FILE\.py:NAME"):
        driven("nobody", places={"a": at(1.0, 1.0)})
    with pytest.raises(SpecError, match="cannot be run: FileNotFoundError"):
        driven("there/is/none.py:Mine", places={"a": at(1.0, 1.0)})


def test_options_are_keyword_arguments(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from touchline.team_algorithms import VelocityWish\n"
        "class Mine:\n"
        "    def __init__(self, speed):\n"
        "        self.speed = speed\n"
        "    def decide(self, now):\n"
        "        return {name: VelocityWish(self.speed, 0.0) for name in now.robots}\n"
    )
    choice = AlgorithmChoice(use=f"{file}:Mine", options={"speed": 0.2})
    team = TeamScenario.model_validate({"places": {"a": at(1.0, 1.0)}, "world": QUIET, "duration_s": 4.0, "area": AREA})
    run = TeamRun(team.model_copy(update={"algorithm": choice, "avoid": "plans"}))
    run.run()
    assert 0.6 < run.robots["a"].emulator.world.pose[0] - 1.0 < 0.85


@pytest.mark.parametrize("avoid", ["cells", "plans", "barriers", "none"])
def test_a_coordinator_is_ready_whatever_keeps_robots_apart(avoid: str) -> None:
    team = TeamScenario.model_validate({"algorithm": {"use": "grid-ways"}, "avoid": avoid})
    warm_up_team(team, free_area(team))
