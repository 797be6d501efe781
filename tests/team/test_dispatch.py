"""Dispatch of tasks: the assignment beside the best one on small cases, and teams of points that obey at once."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from itertools import combinations, permutations, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from touchline.coordination.dispatch.dispatch_figures import dispatch_figures, why_not_dispatched
from touchline.coordination.dispatch.dispatch_memory import DispatchMemory
from touchline.coordination.dispatch.dispatcher import TaskDispatcher
from touchline.coordination.dispatch.distance_table import DistanceTable
from touchline.coordination.dispatch.insertion_kernels import (
    FreeRobots,
    Rates,
    RoutingProblem,
    TaskTable,
    WaysBetween,
)
from touchline.coordination.dispatch.queue_messages import follow_order
from touchline.coordination.dispatch.route_planning import RobotFigures
from touchline.coordination.dispatch.task_records import ENDED
from touchline.coordination.dispatch.task_routes import TaskRoutes, route_times
from touchline.coordination.start_poses import free_area
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.errors import SpecError
from touchline.schemas.spec import parse
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.team import TeamScenario

pytestmark = pytest.mark.xdist_group("team")

FULL_WH = 32.0
RATES = Rates(0.5, 2.0, 20.0, 12.0, 60.0, FULL_WH, 0.0, 3.2, 10.0)


def problem(
    seed: int, robots: int, tasks: int, *, priority: tuple[int, ...] = (), charge_wh: float = FULL_WH, docks: int = 1
) -> RoutingProblem:
    """Return robots and deliveries at random places of 10 × 10 m."""
    random = np.random.default_rng(seed)
    xy = random.uniform(0.0, 10.0, (2 * tasks, 2))
    docked = np.vstack((xy, random.uniform(0.0, 10.0, (1, 2))[:docks]))
    here = random.uniform(0.0, 10.0, (robots, 2))
    between = np.hypot(*(docked[:, None] - docked[None]).transpose(2, 0, 1))
    away = np.hypot(*(here[:, None] - docked[None]).transpose(2, 0, 1))
    first = 2 * np.arange(tasks)
    none = np.full(robots, math.inf)
    return RoutingProblem(
        FreeRobots(
            np.zeros(robots),
            np.full(robots, charge_wh),
            away,
            away[:, -1].copy() if docks else none,
            np.full(robots, 2 * tasks),
        ),
        TaskTable(
            first,
            first + 1,
            between[first, first + 1] / 0.5 + 2.0,
            np.full(tasks, 10.0),
            np.zeros(tasks),
            random.uniform(20.0, 60.0, tasks),
            np.array(priority or (0,) * tasks, dtype=np.int64),
        ),
        WaysBetween(
            between,
            between[:, -1].copy() if docks else np.full(len(docked), math.inf),
            np.full(len(docked), 2 * tasks),
        ),
        RATES,
    )


def cost(given: RoutingProblem, routes: list[list[int]]) -> float:
    return sum(route_times(given, robot, route)[0] for robot, route in enumerate(routes))


def all_routes(tasks: int) -> Iterator[list[list[int]]]:
    """Every way to share tasks between two robots."""
    for count in range(tasks + 1):
        for one in combinations(range(tasks), count):
            rest = [task for task in range(tasks) if task not in one]
            for pair in product(permutations(one), permutations(rest)):
                yield [list(route) for route in pair]


def test_one_task_goes_to_the_robot_that_finishes_it_first() -> None:
    for seed in range(20):
        given = problem(seed, 5, 1)
        times = [route_times(given, robot, [0])[0] for robot in range(5)]
        assert TaskRoutes(given).routes[int(np.argmin(times))] == [0]


def test_routes_are_nearly_as_good_as_the_best_of_all() -> None:
    ratios = []
    for seed in range(40):
        given = problem(seed, 2, 4)
        best = min(cost(given, routes) for routes in all_routes(4))
        ratios.append(cost(given, TaskRoutes(given).routes) / best)
    assert min(ratios) >= 1.0 - 1e-9
    assert np.median(ratios) <= 1.01
    assert max(ratios) <= 1.4


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10_000),
    st.integers(1, 4),
    st.lists(st.integers(0, 2), min_size=1, max_size=9),
    st.sampled_from((FULL_WH, 4.0, 3.3)),
)
def test_every_task_is_in_one_route_and_none_of_high_priority_waits_for_a_lower(
    seed: int, robots: int, priority: list[int], charge_wh: float
) -> None:
    count = len(priority)
    given = problem(seed, robots, count, priority=tuple(priority), charge_wh=charge_wh)
    found = TaskRoutes(given)
    assert sorted(task for route in found.routes for task in route) == list(range(count))
    for robot, route in enumerate(found.routes):
        high = [task for task in route if priority[task] == max(priority)]
        alone = route_times(given, robot, high)[1]
        assert (found.finished_s[high] <= alone + 1e-6).all()


def test_a_charge_is_inserted_where_it_is_needed_and_costs_its_time() -> None:
    full, low = problem(3, 1, 1), problem(3, 1, 1, charge_wh=3.3)
    away_m = low.robots.dock_m[0]
    by_dock_s = away_m / 0.5 + 2.0
    charging_s = (FULL_WH - (3.3 - by_dock_s * 20.0 / 3600.0)) * 60.0
    on_s = low.ground.between_m[2, 0] / 0.5 + 2.0
    expected_s = by_dock_s + charging_s + on_s + low.tasks.drive_s[0] + 10.0
    assert TaskRoutes(low).finished_s[0] == pytest.approx(expected_s)
    assert TaskRoutes(full).finished_s[0] < expected_s
    assert math.isnan(TaskRoutes(problem(3, 1, 1, charge_wh=3.3, docks=0)).finished_s[0])


AREA = {"outline": [(0, 0), (8, 0), (8, 8), (0, 8)]}
DOCK = {"a": {"x_m": 7.5, "y_m": 0.5, "power_w": 3000.0}}
FIGURES = RobotFigures(speed_mps=0.4, driving_w=18.0, standing_w=12.0, battery_wh=FULL_WH)


class Points:
    """Robots that drive straight to where they are told, at 0.4 m/s, and charge at docks within a minute."""

    def __init__(self, spec: Mapping[str, Any], homes: Mapping[str, complex]) -> None:
        self.spec = task = parse(DispatchTask, json.dumps(spec), "requests.json")
        self.area = free_area(TeamScenario.model_validate({"area": AREA, "robots": len(homes)}))
        self.dispatcher = TaskDispatcher(task, self.area, homes, FIGURES, 0.2)
        self.places, self.silent, self.fixed, self.now_s = dict(homes), set[str](), set[str](), 0.0
        self.charges = {name: task.charges.get(name, 1.0) for name in homes}
        self.docked: list[set[str]] = []

    def run(self, seconds: float) -> Points:
        until_s = self.now_s + seconds
        while self.now_s < until_s:
            goals = self.dispatcher.update(self.now_s, self.places, self.charges, self.silent)
            at_dock = {name for name, at in self.places.items() if abs(at - (7.5 + 0.5j)) < 0.15}
            self.docked.append(at_dock)
            for name in self.places.keys() - self.silent - self.fixed:
                way = goals[name] - self.places[name]
                self.places[name] += way * min(0.16 / abs(way), 1.0) if way else 0.0
                gain = 0.01 if name in at_dock else -0.0002
                self.charges[name] = min(self.charges[name] + gain, 1.0)
            self.now_s += 0.4
        return self

    def __getitem__(self, name: str) -> Any:
        return next(each for each in self.dispatcher.queue()["tasks"] if each["id"] == name)


def delivery(name: str, **fields: Any) -> dict[str, Any]:
    return {"id": name, "category": "delivery", "pickup": (2, 2), "dropoff": (6, 6), **fields}


def test_dispatchers_that_follow_each_other_do_every_task_once() -> None:
    homes = {"a": 0.5 + 0.5j, "b": 7.5 + 7.5j}
    spec = {"requests": [delivery(name) for name in "defg"], "docks": DOCK, "charges": {"b": 0.15}, "recharge_soc": 0.6}
    one, other = (Points(spec, homes).run(1.0) for _ in range(2))
    ended: dict[str, float] = {}
    under_way = 0
    for until_s in (3.0, 9.0, 14.0, 22.0, 60.0, 400.0):
        one.run(until_s - one.now_s)
        other.run(until_s - other.now_s)
        now = {each.id: each.finished_s for each in other.dispatcher.records if each.state in ENDED}
        assert ended.items() <= now.items()
        ended = now
        under_way += sum(robot.job is not None for robot in other.dispatcher.robots.values())
        memory = parse(DispatchMemory, other.dispatcher.memory(0.0).model_dump_json(), "memory")
        other.dispatcher = TaskDispatcher(other.spec, other.area, other.places, FIGURES, 0.2)
        other.dispatcher.restore(memory)
    assert under_way > 5
    assert ended == pytest.approx({each.id: each.finished_s for each in one.dispatcher.records}, abs=2.0)


def test_a_delivery_goes_through_its_states_and_is_timed() -> None:
    team = Points({"requests": [delivery("d", deadline_s=10.0)]}, {"a": 0.5 + 0.5j, "b": 7.5 + 7.5j}).run(1.0)
    assert team["d"]["state"] == "delayed"
    assert team["d"]["robot"] == "a"
    assert "drives to place 1 of 2; expected" in team["d"]["reason"]
    assert team["d"]["late_s"] > 20.0
    team.run(60.0)
    done = team["d"]
    assert done["state"] == "completed"
    assert done["finished_s"] == pytest.approx((math.hypot(1.5, 1.5) + math.hypot(4, 4)) / 0.4 + 10.0, abs=2.0)
    assert done["late_s"] == pytest.approx(done["finished_s"] - 10.0)
    assert team.dispatcher.done
    figures = dispatch_figures(team.dispatcher.queue())
    assert figures["makespan_s"] == done["finished_s"]
    assert figures["robots"]["a"]["driven_m"] > 7.0
    assert abs(team.places["a"] - (0.5 + 0.5j)) < 0.5  # it has parked where it started


def test_a_task_of_a_silent_robot_is_done_by_another_unless_it_has_the_goods() -> None:
    team = Points({"requests": [delivery("d"), delivery("e", priority=1)]}, {"a": 2 + 1.5j, "b": 0.5 + 7.5j}).run(2.0)
    assert {team["e"]["robot"], team["d"]["robot"]} == {"a", "b"}
    team.run(8.0)
    mine = next(each for each in ("d", "e") if team[each]["robot"] == "a")
    other = "e" if mine == "d" else "d"
    team.silent = {"a"}
    team.run(20.0)
    assert team[mine]["state"] == "failed"
    assert team[mine]["reason"].startswith("a is silent; the goods are on a at (")
    team.run(80.0)
    assert team[other]["state"] == "completed"
    assert why_not_dispatched(team.dispatcher.queue()).startswith(f"1 tasks are not completed, first {mine}, failed")


def test_a_task_without_goods_goes_to_another_robot() -> None:
    team = Points({"requests": [delivery("d")]}, {"a": 0.5 + 0.5j, "b": 0.5 + 7.5j}).run(1.0)
    assert team["d"]["robot"] == "a"
    team.silent = {"a"}
    team.run(1.0)
    assert (team["d"]["robot"], team["d"]["state"]) == ("b", "underway")
    team.silent = {"a", "b"}
    team.run(1.0)
    assert team["d"]["state"] == "failed_to_assign"
    assert team["d"]["reason"] == "no robot can be used: a is silent, b is silent"
    team.silent = set()
    assert team.run(60.0)["d"]["state"] == "completed"


def test_a_task_at_whose_place_a_lost_robot_stands_fails() -> None:
    requests = [{"id": "g", "category": "go_to_place", "place": (4, 4), "earliest_start_s": 20.0}]
    team = Points({"requests": requests}, {"a": 4 + 3.8j, "b": 2 + 2j})
    team.silent = {"a"}
    team.run(40.0)
    assert (team["g"]["state"], team["g"]["reason"]) == ("failed", "a, which is silent, stands at its place")


def test_a_robot_that_is_carried_away_is_no_obstacle_and_may_come_back() -> None:
    requests = [{"id": "g", "category": "go_to_place", "place": (4, 4), "earliest_start_s": 20.0}]
    team = Points({"requests": requests}, {"a": 4 + 3.8j, "b": 2 + 2j}).run(1.0)
    del team.places["a"]
    team.run(40.0)
    assert (team["g"]["state"], team["g"]["robot"]) == ("completed", "b")
    assert team.dispatcher.queue()["robots"]["a"]["reason"] == "has been removed"
    team.places["a"] = 1 + 1j
    assert team.run(1.0).dispatcher.queue()["robots"]["a"]["state"] == "idle"


def test_ways_lead_round_walls() -> None:
    wall = ((2.9, 0.0), (3.1, 0.0), (3.1, 5.0), (2.9, 5.0))
    fields = {"area": {"outline": [(0, 0), (6, 0), (6, 6), (0, 6)], "obstacles": [wall]}}
    table = DistanceTable(free_area(TeamScenario.model_validate(fields)), 0.2)
    ((length_m, near_m),) = table.lengths_m([1 + 3j], [5 + 3j, 1 + 4j])
    assert 5.9 < length_m < 6.4  # 2 · |2 + 2.2 i| and the clearance
    assert near_m == pytest.approx(1.0, abs=0.05)
    assert abs(table.aim(1 + 3j, 5 + 3j) - (2.7 + 5.2j)) < 0.5


def test_a_robot_that_does_not_move_is_blocked_then_given_up() -> None:
    team = Points({"requests": [delivery("d")]}, {"a": 0.5 + 0.5j, "b": 7.5 + 7.5j})
    team.fixed = {"a"}
    team.run(15.0)
    assert team["d"]["state"] == "blocked"
    assert team["d"]["reason"].startswith("a has stood for 1")
    team.run(60.0)
    assert team["d"]["robot"] == "b"
    (stood,) = team.dispatcher.stands
    assert stood["robot"] == "a"
    assert stood["until_s"] - stood["from_s"] > 50.0


def test_a_robot_that_drives_and_comes_no_nearer_is_blocked() -> None:
    team = Points({"requests": [delivery("d")]}, {"a": 0.5 + 0.5j})
    team.fixed = {"a"}
    for number in range(90):
        team.places["a"] = 0.5 + 0.5j + 0.3 * (-1) ** number
        team.run(1.0)
    assert team["d"]["state"] == "blocked"
    assert "a has come no nearer for " in team["d"]["reason"]


def test_one_robot_at_a_time_charges_and_low_ones_do_so_before_their_task() -> None:
    low = {"a": 0.15, "b": 0.12, "c": 0.19}
    homes = {"a": 5 + 1j, "b": 5 + 3j, "c": 5 + 5j}
    spec = {"requests": [delivery("d")], "docks": DOCK, "charges": low, "recharge_soc": 0.9}
    team = Points(spec, homes).run(3.0)
    assert team["charge-1"]["state"] == "underway"
    waits = [team[f"charge-{k}"] for k in (1, 2, 3) if "waits for a dock" in team[f"charge-{k}"]["reason"]]
    assert len(waits) == 2
    assert "b uses a" in waits[0]["reason"]  # the one with the least charge is first
    team.run(400.0)
    assert max(map(len, team.docked)) == 1
    assert [team[f"charge-{k}"]["state"] for k in (1, 2, 3)] == ["completed"] * 3
    assert team["d"]["state"] == "completed"
    assert all(each["charged_wh"] > 10.0 for each in team.dispatcher.queue()["robots"].values())


def test_charging_can_be_ordered_and_a_battery_that_never_suffices_is_told_with_figures() -> None:
    charge = {"id": "c", "category": "charge", "robot": "b"}
    patrol = {"id": "p", "category": "patrol", "places": [(1, 1), (7, 7)], "rounds": 500}
    team = Points({"requests": [charge, patrol], "docks": DOCK}, {"a": 1 + 1j, "b": 7 + 4j}).run(2.0)
    assert (team["c"]["robot"], team["c"]["state"]) == ("b", "underway")
    assert team["p"]["state"] == "failed_to_assign"
    assert "insufficient battery: needs " in team["p"]["reason"]
    assert "has 32.00 Wh, of which 3." in team["p"]["reason"]


def test_robots_wait_for_their_turn_at_one_place_and_idle_ones_make_room() -> None:
    goto = {"category": "go_to_place", "place": (4, 4), "dwell_s": 20}
    team = Points({"requests": [goto, goto]}, {"a": 4 + 2j, "b": 4 + 6.5j, "c": 4 + 4j}).run(1.0)
    team.run(14.0)
    waiting = [each for each in team.dispatcher.queue()["tasks"] if "waits for" in each["reason"]]
    assert [each["reason"].split(": ")[1] for each in waiting] == ["waits for c"]
    team.run(60.0)
    assert {each["state"] for each in team.dispatcher.queue()["tasks"]} == {"completed"}


def test_an_idle_robot_makes_room() -> None:
    goto = {"id": "g", "category": "go_to_place", "place": (4, 4), "dwell_s": 2}
    charge = {"category": "charge", "robot": "b", "earliest_start_s": 100.0}
    team = Points({"requests": [goto, charge], "docks": DOCK}, {"a": 4 + 1j, "b": 4.2 + 4j})
    team.charges["b"] = 0.3  # it is nearer, but may not: its charge would not last
    team.run(40.0)
    assert team["g"]["state"] == "completed"


def test_orders_are_followed_or_refused_with_field_and_remedy() -> None:
    team = Points({"requests": [delivery("d")], "places": {"door": (1, 7)}}, {"a": 0.5 + 0.5j}).run(1.0)
    order = {"add": [{"category": "go_to_place", "place": "door", "labels": ["guest"], "earliest_start_s": 90}]}
    assert follow_order(team.dispatcher, json.dumps(order)) == "added: task-2"
    assert follow_order(team.dispatcher, '{"cancel": "d"}') == "d: canceled on request"
    assert team.run(2.0)["d"]["state"] == "canceled"
    assert team["task-2"]["state"] == "dispatched"
    queue = json.loads(follow_order(team.dispatcher, "{}"))
    assert queue["tasks"][1]["labels"] == ["guest"]
    assert team.run(100.0)["task-2"]["state"] == "completed"
    assert team["task-2"]["finished_s"] >= 90.0
    for order_text, told in (
        ('{"cancel": "d"}', "is 'd', which is canceled"),
        ('{"cancel": "x"}', "is 'x', which is no task"),
        (
            '{"add": [{"category": "go_to_place", "place": "x"}]}',
            "is 'x', which is no name of places; use door",
        ),
        ('{"add": [{"category": "charge"}]}', "is 'charge', but there is no dock; give the team a dock"),
        ('{"add": [{"category": "fly"}]}', "add[0]"),
    ):
        with pytest.raises(SpecError) as refused:
            follow_order(team.dispatcher, order_text)
        assert told in str(refused.value)


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"requests": [delivery("d", pickup="there")]}, "requests[0].pickup is 'there', no name of places"),
        ({"requests": [delivery("d"), delivery("d")]}, "requests[1].id is 'd' again"),
        ({"requests": [{"category": "charge"}]}, "docks is empty"),
        ({"requests": [delivery("d", deadline_s=-1)]}, "deadline_s"),
        ({"recharge_threshold": 0.9, "recharge_soc": 0.5}, "recharge_soc is not more than recharge_threshold"),
    ],
)
def test_a_file_that_is_not_usable_names_the_field(fields: dict[str, Any], told: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse(DispatchTask, json.dumps(fields), "requests.json")
    assert told in str(refused.value)


def test_emulated_robots_fail_charge_and_keep_priorities() -> None:
    """One computer hangs with goods on board, one battery is low, and what is urgent comes first."""
    requests = [
        delivery("lost", pickup=(1.5, 1.5), dropoff=(5, 5), pickup_s=1.0, priority=2),
        delivery("first", pickup=(5, 1), dropoff=(1, 5), priority=1),
        *({"id": f"go-{k}", "category": "go_to_place", "place": (4.0 - k, 4.5)} for k in range(2)),
    ]
    places = {
        name: {"x_m": x, "y_m": y, "heading_rad": 0.0}
        for name, x, y in (("a", 0.8, 1.5), ("b", 4.0, 1.0), ("c", 5.2, 3.0))
    }
    task = {
        "kind": "dispatch",
        "requests": requests,
        "docks": {"corner": {"x_m": 5.5, "y_m": 5.5, "power_w": 4_000.0}},
        "charges": {"c": 0.12},
        "recharge_soc": 0.5,
    }
    fields = {"area": {"outline": [(0, 0), (6, 0), (6, 6), (0, 6)]}, "places": places, "task": task}
    run = TeamRun(TeamScenario.model_validate(fields | {"frozen": {"a": [{"start_s": 9.0}]}, "duration_s": 120.0}))
    run.run()
    figures = team_figures(run, 1.0)
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    tasks = {each["id"]: each for each in figures["dispatch"]["tasks"]}
    assert tasks["lost"]["state"] == "failed"
    assert tasks["lost"]["reason"].startswith("a is silent; the goods are on a at (")
    assert tasks["first"]["state"] == "completed"
    assert tasks["first"]["robot"] == "b"
    assert tasks["charge-1"]["state"] == "completed"
    assert tasks["charge-1"]["robot"] == "c"
    assert {tasks["go-0"]["state"], tasks["go-1"]["state"]} == {"completed"}
    robots = figures["dispatch"]["robots"]
    assert robots["c"]["charge"] > 0.45
    assert 0.37 * FULL_WH < robots["c"]["charged_wh"] < 0.45 * FULL_WH
    assert robots["b"]["used_wh"] > 0.1
    assert robots["a"]["state"] == "out"


@pytest.mark.parametrize("field", ["docks.far", "place"])
def test_a_place_where_robots_cannot_be_is_refused(field: str) -> None:
    place = (0.1, 1.0) if field == "place" else (1.0, 1.0)
    spec: dict[str, Any] = {"requests": [{"category": "go_to_place", "place": place}]}
    if field == "docks.far":
        spec["docks"] = {"far": {"x_m": 90.0, "y_m": 1.0}}
    with pytest.raises(SpecError, match=rf"{field} is \(.*\) m, not in the area or within 0.2 m of a wall"):
        Points(spec, {"a": 1 + 1j})
