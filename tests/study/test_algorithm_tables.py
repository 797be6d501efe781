"""Tables of algorithms from the same starts: who arrives when, how fairly, and what keeping apart has changed."""

import sys
from types import ModuleType
from typing import Any

import pytest

from touchline.coordination.free_area import FreeArea
from touchline.team_algorithms import Me, Team, VelocityWish
from touchline_research.network.algorithms import algorithm_tables, algorithm_trials, jain, swap_rules
from touchline_research.network.team_trials import TeamRecord, TeamTrial
from touchline_research.network.wishes import OrcaLibrary

pytestmark = pytest.mark.xdist_group("team")


def run(name: str, avoid: str, duration_s: float, robots: int = 4) -> TeamRecord:
    [rules] = [rules for rules in swap_rules() if rules[:2] == (name, avoid)]
    return TeamTrial(rules, robots, 1, "swap", duration_s).run()


def test_jains_index_is_1_if_all_have_the_same_and_less_the_more_one_has() -> None:
    assert jain([2.0, 2.0, 2.0]) == pytest.approx(1.0)
    assert jain([1.0, 0.0, 0.0, 0.0]) == pytest.approx(0.25)
    assert jain([1.0, 3.0]) == pytest.approx(0.8)
    assert jain([0.0, 0.0]) == 1.0


def test_the_table_says_who_touches_who_arrives_and_what_was_changed() -> None:
    free, kept, goals = (
        run("straight velocities", "none", 12.0),
        run("straight velocities", "plans", 3.0),
        run("goals", "plans", 30.0),
    )
    table, others = algorithm_tables([free, kept, goals])
    unsafe, safe, own = table.rows
    assert unsafe.figures["contacts"] > 0 == safe.figures["contacts"]
    assert (unsafe.met, safe.met, own.met) == (None, True, True)
    assert unsafe.figures["changed"] == 0.0 < safe.figures["changed"]
    assert own.cells[3] == "4 of 4" and safe.cells[3] == "0 of 4"
    assert own.cells[2] == f"{goals.figures['goals']['all_arrived_s']:.1f} s"
    assert max(goals.arrivals_s) == pytest.approx(goals.figures["goals"]["all_arrived_s"], abs=0.5)
    assert len(set(kept.arrivals_s)) == 1  # the end, for all
    assert all(len(row.texts) == len(table.headings) for row in table.rows)
    assert not others.rows


def test_all_runs_of_a_seed_start_alike() -> None:
    trials = [trial for trial in algorithm_trials(4, 2, 0.1) if trial.seed == 2 and trial.rules.avoid == "plans"]
    assert len({trial.rules.name for trial in trials}) >= 14
    assert {(trial.robots, trial.scattered, trial.duration_s) for trial in trials} == {(4, False, 6.0), (4, True, 6.0)}


def test_orcas_library_is_told_where_all_are_and_is_done_as_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[Any, ...]] = []

    class Simulator:
        def __init__(self, *given: float) -> None:
            told.append(given)

        def __getattr__(self, name: str) -> Any:
            return lambda *given: told.append((name, *given))

        def get_agent_velocity(self, number: int) -> VelocityWish:
            return type("Vector2", (), {"x": 0.1 + number, "y": 0.2})()

    library = ModuleType("pyrvo")
    library.RVOSimulator = Simulator  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pyrvo", library)
    area = FreeArea.of([(0, 0), (6, 0), (6, 6), (0, 6)])
    given = {"team": ("a", "b"), "now_s": 0.0, "period_s": 0.4, "heading_rad": 0.0, "vx_mps": 0.3, "vy_mps": 0.0}
    more = {"importance": 1.0, "speed_max_mps": 0.5, "radius_m": 0.2, "range_m": 2.0, "area": area, "seed": 1}
    a = Me(name="a", x_m=1.0, y_m=1.0, goal_m=(1.0, 1.2), **given, **more)
    b = Me(name="b", x_m=5.0, y_m=1.0, goal_m=(5.0, 1.0), **given, **more)
    wishes = OrcaLibrary().decide(Team(0.0, {"a": a, "b": b}, lambda x, y: 1.0))
    assert wishes == {"a": VelocityWish(0.1, 0.2), "b": VelocityWish(1.1, 0.2)}
    assert told[0] == (0.4, 3.0, 10, 3.0, 3.0, pytest.approx(0.3), 0.5)
    assert ("set_agent_position", 1, (5.0, 1.0)) in told
    assert ("set_agent_pref_velocity", 0, pytest.approx((0.0, 0.3))) in told
    assert ("set_agent_pref_velocity", 1, (0.0, 0.0)) in told
