"""Teams of emulated robots in lockstep: with slip, a noisy camera, lag and bad radio no two ever touch."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from benchmarks._team_cases import CASES, team_of
from tests.with_full import with_full
from touchline.coordination import coordination
from touchline.jobs.team.random_team_faults import with_random_faults
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.errors import SpecError
from touchline.schemas.spec import parse
from touchline.schemas.team import LOSSY_LEASE_S, TeamScenario

pytestmark = pytest.mark.xdist_group("team")  # by one worker, which compiles or loads the kernels once
BODY_M = 0.177
LOSSY = {"follower": "mpc", "drive": {"slip_relative": 0.004}, "team": {"lease_s": LOSSY_LEASE_S}}


def driven(**told: Any) -> tuple[TeamRun, dict[str, Any]]:
    """A run, and its figures."""
    hashed = told.pop("hashed", False)
    run = TeamRun(TeamScenario.model_validate(told), hashed=hashed)
    run.run()
    return run, team_figures(run, 1.0)


def test_a_team_spreads_as_well_as_points_do() -> None:
    _, figures = driven(robots=10, duration_s=40.0)
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    assert figures["bodies_apart_m"] > 0.01
    assert figures["deploy"]["of_points"] < 1.015
    assert figures["deploy"]["spread_s"] <= 20.0
    assert figures["driven_mean_m"] <= 3.5
    assert figures["beyond_walls_robot_s"] == 0.0


def test_a_team_changes_places() -> None:
    run, figures = driven(robots=8, task={"kind": "swap"}, world=world(1))
    assert figures["success"], figures["reason"]
    assert figures["goals"]["arrived"] == 8
    assert figures["goals"]["all_arrived_s"] <= 45.0
    assert figures["closest_m"] >= 2.0 * BODY_M + 0.01
    assert run.guide.believed.nearest_m >= 2.0 * run.team.radius_m - 0.04


def test_a_team_changes_places_by_committed_plans_in_half_the_time() -> None:
    run, figures = driven(robots=8, task={"kind": "swap"}, world=world(1), avoid="plans", hashed=True)
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    assert figures["goals"]["all_arrived_s"] <= 14.0
    assert figures["closest_m"] >= 2.0 * BODY_M + 0.01
    assert run.guide.believed.nearest_m >= 2.0 * run.team.radius_m - 1e-9
    assert run.guide.believed.outside_m <= 0.012


def test_plans_keep_bodies_off_walls() -> None:
    room = {"outline": [(0, 0), (5, 0), (5, 4), (0, 4)], "obstacles": [[(2, 2), (3, 2), (3, 3), (2, 3)]]}
    _, figures = driven(robots=6, area=room, duration_s=30.0, avoid="plans")
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    assert figures["beyond_walls_robot_s"] == 0.0


def test_a_goal_behind_a_wall_is_reached_by_plans() -> None:
    wall = {"outline": [(0, 0), (6, 0), (6, 6), (0, 6)], "obstacles": [[(2.8, 0), (3.2, 0), (3.2, 4.5), (2.8, 4.5)]]}
    task = {"kind": "goals", "goals": {"a": [(5.0, 1.0)]}}
    _, figures = driven(places={"a": at(1.0, 1.0)}, area=wall, task=task, avoid="plans")
    assert figures["success"], figures["reason"]
    assert figures["goals"]["all_arrived_s"] <= 22.0
    assert figures["contacts"] == 0


def test_a_team_meets_in_a_passage_and_drives_on_the_right() -> None:
    walls = [[(4.5, 0), (5.5, 0), (5.5, 1.9), (4.5, 1.9)], [(4.5, 3.1), (5.5, 3.1), (5.5, 5), (4.5, 5)]]
    area = {"outline": [(0, 0), (10, 0), (10, 5), (0, 5)], "obstacles": walls}
    rows = {"a": 0.8, "b": 1.9, "c": 3.0, "d": 4.1}
    left = {name: at(1.0, y) for name, y in rows.items()}
    right = {name.upper(): at(9.0, y) | {"heading_rad": 3.14} for name, y in rows.items()}
    goals = {name: [(9.0, y)] for name, y in rows.items()} | {name.upper(): [(1.0, y)] for name, y in rows.items()}
    _, figures = driven(places=left | right, area=area, task={"kind": "goals", "goals": goals}, avoid="plans")
    assert figures["success"], figures["reason"]
    assert figures["goals"]["all_arrived_s"] <= 25.0
    assert figures["contacts"] == 0
    assert figures["beyond_walls_robot_s"] == 0.0


def test_robots_pass_each_other_in_a_corridor_with_room_for_one() -> None:
    corridor = {"outline": [(0, 0), (7, 0), (7, 0.7), (3.7, 0.7), (3.7, 1.9), (3, 1.9), (3, 0.7), (0, 0.7)]}
    task = {"kind": "goals", "goals": {"a": [(6.6, 0.35)], "b": [(0.4, 0.35)]}}
    _, figures = driven(places={"a": at(0.4, 0.35), "b": at(6.6, 0.35)}, area=corridor, task=task, avoid="plans")
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    assert figures["beyond_walls_robot_s"] == 0.0


def test_a_robot_that_cannot_keep_to_its_plan_stops_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coordination, "body_radius_m", lambda vehicle: 0.1999)
    _, figures = driven(robots=2, task={"kind": "swap"}, world=world(1), avoid="plans", duration_s=5.0)
    assert not figures["success"]
    assert "off its plan" in figures["reason"]


def test_plans_keep_robots_apart_when_half_of_all_messages_are_lost_and_late() -> None:
    links = {"loss": 0.5, "delay_s": 0.2}
    run, figures = driven(robots=8, task={"kind": "swap"}, world=world(1), avoid="plans", links=links)
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    assert run.guide.believed.nearest_m >= 2.0 * run.team.radius_m - 1e-9


def test_plans_refuse_robots_that_cannot_follow_them() -> None:
    with pytest.raises(ValidationError, match="frozen stops a robot where its plan does not"):
        driven(robots=2, avoid="plans", frozen={"tb1": [{"start_s": 5.0}]})
    with pytest.raises(ValidationError, match="the fault bumper stops a robot where its plan does not"):
        driven(robots=2, avoid="plans", faults={"tb1": [{"kind": "bumper"}]})


@pytest.mark.parametrize("avoid", ["plans", "barriers"])
def test_a_robot_that_is_to_stand_comes_to_rest_at_the_end_of_its_plan(avoid: str) -> None:
    blind = {"tb1": [{"kind": "camera-outage", "start_s": 4.0}], "tb3": [{"kind": "battery-low", "start_s": 5.0}]}
    run, figures = driven(robots=5, task={"kind": "swap"}, world=world(2), avoid=avoid, faults=blind, duration_s=16.0)
    assert figures["contacts"] == 0
    assert "tb3" in figures["stopped"]
    assert "waiting for its pose" in figures["stopped"]["tb1"]
    assert run.guide.problem == ""
    assert run.guide.believed.nearest_m >= 2.0 * run.team.radius_m - 1e-9
    assert run.guide.believed.outside_m <= 0.02


def test_a_robot_without_a_pose_for_15_s_stays_within_what_its_plan_allows() -> None:
    case = next(case for case in CASES if case.name == "token_planner")
    healthy = team_of(case, 10, "barriers", 3, 0.5, 0.5, links=0.5, delay_s=0.2)
    faults = with_random_faults(healthy, 3).faults
    run = TeamRun(healthy.model_copy(update={"faults": faults}))
    run.run()
    assert run.guide.problem == ""
    assert run.guide.believed.outside_m <= 0.015


def world(seed: int) -> dict[str, Any]:
    return TeamScenario().world.model_copy(update={"seed": seed}).model_dump()


def test_goals_are_driven_to_in_turn_and_formations_taken() -> None:
    places = {"a": at(1.0, 1.0), "b": at(2.0, 1.0), "c": at(3.0, 1.0)}
    square = {"outline": [(0, 0), (4, 0), (4, 4), (0, 4)]}
    goals = {"kind": "goals", "goals": {"a": [(3.0, 3.0), (1.0, 3.0)], "c": [(1.0, 2.0)]}}
    run, figures = driven(places=places, area=square, task=goals)
    assert figures["success"], figures["reason"]
    assert {name: [round(x) for x in run.robots[name].emulator.world.pose[:2]] for name in run.names} == {
        "a": [1, 3],
        "b": [2, 1],
        "c": [1, 2],
    }
    line = {"kind": "formation", "shape": "line", "x_m": 2.0, "y_m": 2.0, "heading_rad": 1.5708, "apart_m": 0.6}
    _, figures = driven(places=places, area=square, task=line)
    assert figures["success"], figures["reason"]


def at(x_m: float, y_m: float) -> dict[str, float]:
    return {"x_m": x_m, "y_m": y_m, "heading_rad": 0.0}


def test_a_room_with_a_pillar_is_shared() -> None:
    room = {"outline": [(0, 0), (5, 0), (5, 4), (0, 4)], "obstacles": [[(2, 2), (3, 2), (3, 3), (2, 3)]]}
    _, figures = driven(robots=4, area=room, duration_s=30.0)
    assert figures["success"], figures["reason"]
    assert figures["beyond_walls_robot_s"] == 0.0
    assert figures["deploy"]["of_points"] is None


def test_the_order_of_robots_and_a_further_one_change_no_others_noise() -> None:
    places = {"tb1": at(1.0, 1.0), "tb2": at(2.0, 1.0), "tb3": at(3.0, 1.0)}
    hashes = []
    for names in (("tb1", "tb2", "tb3"), ("tb3", "tb1", "tb2")):
        run, _ = driven(places={name: places[name] for name in names}, duration_s=4.0, hashed=True)
        hashes.append(run.hashes)
    assert hashes[0] == hashes[1]
    assert len(set(hashes[0].values())) == 3
    seeds = [TeamScenario(robots=count).setup("tb2", run.starts["tb2"]).scenario.seed for count in (2, 20)]
    assert seeds[0] == seeds[1]


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.full)])
def test_half_of_the_messages_lost_and_the_others_late(seed: int) -> None:
    _, figures = driven(
        robots=5, duration_s=20.0, links={"loss": 0.5, "delay_s": 1.0}, onboard=LOSSY, world=world(seed)
    )
    assert figures["success"], figures["reason"]
    assert figures["bodies_apart_m"] > 0.01


def test_who_freezes_is_passed_and_told_of() -> None:
    run, figures = driven(
        robots=6, task={"kind": "swap"}, duration_s=90.0, frozen={"tb2": [{"start_s": 6.0}]}, world=world(3)
    )
    assert figures["contacts"] == 0
    told = figures["goals"]["hindrances"]
    assert "hangs" in told.pop("tb2")
    assert all(told.values())
    assert figures["success"], figures["reason"]
    assert figures["goals"]["arrived"] >= 4
    assert run.guide.problem == ""


def test_a_pressed_bumper_stops_one_robot_and_nobody_runs_into_it() -> None:
    press = {"kind": "bumper", "start_s": 5.0, "duration_s": 1.0}
    _, figures = driven(robots=4, duration_s=15.0, faults={"tb1": [press]})
    assert figures["stopped"] == {"tb1": "the bumper is pressed"}
    assert figures["success"], figures["reason"]


@pytest.mark.parametrize("seed", with_full(0, full=(1, 2, 3)))
def test_random_faults_lead_to_no_contact_of_robots_that_obey(seed: int) -> None:
    team = with_random_faults(TeamScenario(robots=6, duration_s=30.0), seed)
    assert team.faults or team.frozen
    run = TeamRun(team)
    run.run()
    figures = team_figures(run, 1.0)
    assert figures["contacts_of_obedient"] == 0
    assert figures["success"], figures["reason"]


@pytest.mark.parametrize(
    ("told", "problem"),
    [
        ({"robots": 0}, "robots"),
        ({"radius_m": 0.1}, "radius_m is 0.1 m, less than the body's 0.177 m"),
        (
            {"robots": 50, "area": {"outline": [(0, 0), (2, 0), (2, 2), (0, 2)]}},
            "has room for 16 robots in a grid",
        ),
        ({"area": {"outline": [(0, 0), (2, 2), (2, 0), (0, 2)]}}, "outline crosses itself"),
        ({"places": {"a": at(1.0, 1.0), "b": at(1.1, 1.0)}}, "places.a is 0.10 m from that of b"),
        ({"places": {"a": at(1.0, 9.0)}, "area": {"outline": [(0, 0), (2, 0), (2, 2)]}}, "places.a is outside"),
        ({"places": {"a b": at(1.0, 1.0)}}, "cannot be a robot's"),
        ({"faults": {"tb99": [{"kind": "bumper"}]}}, "tb99"),
        ({"links": {"loss": 1.0}}, "loss"),
        ({"update_s": 0.25}, "update_s"),
        ({"task": {"kind": "dance"}}, "task"),
    ],
)
def test_what_cannot_be_is_refused_by_name(told: dict[str, Any], problem: str) -> None:
    import json

    with pytest.raises(SpecError, match=problem):
        TeamRun(parse(TeamScenario, json.dumps(told), "team.json"))
