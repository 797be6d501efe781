"""Ways of many robots on a grid: valid, complete, shorter when refined, and driven in an order without circles."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from touchline.coordination.mapf.action_order import ActionOrder
from touchline.coordination.mapf.grid_map import AgentGrid, read_map, read_scenario
from touchline.coordination.mapf.lacam import board_of, solve
from touchline.coordination.mapf.lacam_kernels import AgentBoard
from touchline.coordination.mapf.refine import cost, refined
from touchline.coordination.mapf.refine_kernels import arrival
from touchline.coordination.mapf.turning import facing, with_turns
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.errors import PlanningError, SpecError
from touchline.schemas.team import TeamScenario

Ints = NDArray[np.int32]


def grid_of(*rows: str) -> AgentGrid:
    return AgentGrid.of(np.array([[each == "." for each in row] for row in rows]))


def check(grid: AgentGrid, paths: Ints, starts: Ints, goals: Ints) -> None:
    """That paths lead from starts to goals, a cell a step, without two in a cell or two that change places."""
    assert (paths[0] == starts).all()
    assert (paths[-1] == goals).all()
    for before, after in pairwise(paths):
        assert len(np.unique(after)) == len(after)
        assert all(a == b or b in grid.neighbours[a] for a, b in zip(before, after, strict=True))
        moves = set(zip(before.tolist(), after.tolist(), strict=True))
        assert not any(a != b and (b, a) in moves for a, b in moves)


@st.composite
def problems(draw: st.DrawFn) -> tuple[AgentGrid, Ints, Ints]:
    """Agents on a random connected part of a grid."""
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    grid = AgentGrid.of(rng.random((draw(st.integers(2, 9)), draw(st.integers(2, 9)))) > 0.2)
    if not len(grid.cells):
        return problems_default()
    left = board_of(grid, np.array([int(rng.integers(len(grid.cells)))], dtype=np.int32)).left[0]
    part = np.flatnonzero(left < len(grid.cells)).astype(np.int32)
    agents = draw(st.integers(1, max(1, len(part) * 2 // 3)))
    return grid, rng.permutation(part)[:agents], rng.permutation(part)[:agents]


def problems_default() -> tuple[AgentGrid, Ints, Ints]:
    grid = grid_of("..")
    return grid, np.array([0], dtype=np.int32), np.array([1], dtype=np.int32)


@given(problems())
@settings(max_examples=150)
def test_moves_are_valid_or_there_are_none(problem: tuple[AgentGrid, Ints, Ints]) -> None:
    grid, starts, goals = problem
    board = board_of(grid, goals)
    try:
        paths = solve(board, starts)
    except PlanningError as error:
        assert "no moves" in str(error) or "without a result" in str(error)
        return
    check(grid, paths, starts, goals)
    shorter = refined(board, paths, 20)
    check(grid, shorter, starts, goals)
    assert cost(board, shorter) <= cost(board, paths)
    _drive(ActionOrder(shorter), goals)
    headings = np.arange(len(starts), dtype=np.int32) % 4
    turning = with_turns(grid.neighbours, shorter, headings)
    quicker = refined(board, turning, 20, headings=headings)
    for each in (turning, quicker):
        check(grid, each, starts, goals)
        check_turns(grid, each, headings)
    assert squares(board, quicker) <= squares(board, turning)
    _drive(ActionOrder(quicker), goals)


def squares(board: AgentBoard, paths: Ints) -> int:
    """Sum of the squares of the steps until each is at its goal."""
    return sum(arrival(paths, who, goal) ** 2 for who, goal in enumerate(board.goals.tolist()))


def check_turns(grid: AgentGrid, paths: Ints, headings: Ints) -> None:
    """That agents stay for a step before they move to another side, and for two before they move back."""
    for way, first in zip(paths.T.tolist(), headings.tolist(), strict=True):
        heading, stayed = first, 0
        for here, there in pairwise(way):
            if here == there:
                stayed += 1
                continue
            side = grid.neighbours[here].tolist().index(there)
            assert stayed >= min((side - heading) % 4, (heading - side) % 4)
            heading, stayed = side, 0


def _drive(order: ActionOrder, goals: Ints) -> None:
    """Robots move in any order, each with those before it: nobody meets, and all arrive."""
    rng, n = np.random.default_rng(1), len(order.routes)
    reached, ends = np.zeros(n, dtype=np.int64), np.array([len(route) - 1 for route in order.routes])
    while (reached < ends).any():
        free = np.flatnonzero(np.array(order.horizons(reached)) > reached)
        assert len(free), "all wait for each other"
        moving, may = [int(rng.choice(free))], set(free.tolist())
        while moving:
            who = moving.pop()
            assert who in may, "it is not its turn, and another enters its cell"
            reached[who] += 1
            cell = order.routes[who][reached[who]]
            moving += [each for each in range(n) if each != who and order.routes[each][reached[each]] == cell]
    assert [order.routes[who][-1] for who in range(n)] == goals.tolist()


def test_two_that_face_each_other_swap_where_there_is_room() -> None:
    grid = grid_of(".....", "@@.@@")
    starts, goals = np.array([0, 4], dtype=np.int32), np.array([4, 0], dtype=np.int32)
    check(grid, solve(board_of(grid, goals), starts), starts, goals)


def test_that_no_moves_exist_is_proved() -> None:
    corridor = grid_of("...")
    goals = np.array([2, 0], dtype=np.int32)
    with pytest.raises(PlanningError, match="no moves"):
        solve(board_of(corridor, goals), np.array([0, 2], dtype=np.int32))
    with pytest.raises(PlanningError, match="without a way"):
        solve(board_of(grid_of(".@."), np.array([1], dtype=np.int32)), np.array([0], dtype=np.int32))
    with pytest.raises(PlanningError, match="start at the same cell"):
        solve(board_of(corridor, np.array([0, 1], dtype=np.int32)), np.array([1, 1], dtype=np.int32))


def test_a_robot_waits_for_the_one_before_it_and_rows_and_circles_begin_together() -> None:
    row = ActionOrder(np.array([(0, 1), (1, 2)], dtype=np.int32))
    assert row.horizons(np.array([0, 0])) == [1, 1]
    circle = ActionOrder(np.array([(0, 1, 2, 3), (1, 2, 3, 0)], dtype=np.int32))
    assert circle.horizons(np.zeros(4, dtype=np.int64)) == [1, 1, 1, 1]
    late = ActionOrder(np.array([(0, 5), (0, 1), (0, 2), (1, 2)], dtype=np.int32))
    assert late.horizons(np.array([0, 0])) == [0, 2]
    assert late.horizons(np.array([0, 1])) == [1, 2]


def test_a_way_there_and_back_to_let_another_pass_is_not_left_out() -> None:
    aside = ActionOrder(np.array([(1,), (2,), (1,), (0,)], dtype=np.int32))
    assert [aside.horizons(np.array([place])) for place in range(4)] == [[1], [3], [3], [3]]


def test_a_crowded_room_is_left_by_one_door() -> None:
    grid = grid_of("....@....", ".........", "....@....", "....@....")
    west, east = np.flatnonzero(grid.cells[:, 0] < 4), np.flatnonzero(grid.cells[:, 0] > 4)
    starts = np.concatenate((west[:8], east[:8])).astype(np.int32)
    goals = np.concatenate((east[:8], west[:8])).astype(np.int32)
    check(grid, solve(board_of(grid, goals), starts), starts, goals)


def test_ways_become_shorter() -> None:
    rng = np.random.default_rng(2)
    grid = AgentGrid.of(np.ones((10, 10), dtype=np.bool_))
    starts, goals = (rng.permutation(100)[:40].astype(np.int32) for _ in range(2))
    board = board_of(grid, goals)
    paths = solve(board, starts)
    assert cost(board, refined(board, paths, 300)) < 0.9 * cost(board, paths)


def test_ways_with_turns_are_as_quick_as_those_of_one_agent_can_be() -> None:
    grid = grid_of("....", ".@@.", "....")
    goals = np.array([9], dtype=np.int32)
    board, north, east = board_of(grid, goals), *facing(np.array([0.5, 0.0]) * np.pi)
    assert grid.cells[goals[0]].tolist() == [3, 2]
    for heading, steps in ((north, 6), (east, 6), (facing(np.array(-0.5 * np.pi)), 7)):
        headings = np.array([heading], dtype=np.int32)
        detour = np.array([[0, 1, 2, 3, 5, 9]], dtype=np.int32).T
        turning = with_turns(grid.neighbours, detour, headings)
        assert len(refined(board, turning, 1, headings=headings)) - 1 == steps


def test_maps_and_scenarios_of_the_benchmark_are_read(tmp_path: Path) -> None:
    file, scenario = tmp_path / "small.map", tmp_path / "small.scen"
    file.write_text("type octile\nheight 2\nwidth 3\nmap\n.@.\n...\n")
    scenario.write_text("version 1\n0\tsmall.map\t3\t2\t0\t0\t2\t0\t4\n")
    grid = read_map(file)
    starts, goals = read_scenario(scenario, grid, 1)
    assert len(solve(board_of(grid, goals), starts)) == 5
    for agents, text, problem in (
        (2, scenario.read_text(), "has not 2 agents"),
        (1, "version 1\n0\tx\t3\t2\t1\t0\t2\t0\t4\n", "not free"),
        (1, "version 1\n0\tx\t3\t2\t9\t0\t2\t0\t4\n", "does not fit its map"),
    ):
        scenario.write_text(text)
        with pytest.raises(SpecError, match=problem):
            read_scenario(scenario, grid, agents)
    for text in ("", "height 2\nwidth 3\nmap\n...\n", "map\n"):
        file.write_text(text)
        with pytest.raises(SpecError):
            read_map(file)


@pytest.mark.xdist_group("team")
def test_emulated_robots_change_rooms_through_a_door() -> None:
    wall = [[(2.9, 0.0), (3.1, 0.0), (3.1, 1.4), (2.9, 1.4)], [(2.9, 2.6), (3.1, 2.6), (3.1, 4.0), (2.9, 4.0)]]
    places = {"a": (1.0, 1.0), "b": (1.0, 3.0), "c": (5.0, 1.0), "d": (5.0, 3.0)}
    goals = {"a": [places["d"]], "b": [places["c"]], "c": [places["b"]], "d": [places["a"]]}
    told = {
        "area": {"outline": [(0, 0), (6, 0), (6, 4), (0, 4)], "obstacles": wall},
        "places": {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in places.items()},
        "task": {"kind": "goals", "goals": goals},
        "algorithm": {"use": "grid-ways"},
        "avoid": "plans",
        "duration_s": 60.0,
    }
    run = TeamRun(TeamScenario.model_validate(told))
    run.run()
    figures = team_figures(run, 1.0)
    assert figures["success"], figures["reason"]
    assert figures["contacts"] == 0
    assert not figures["algorithm"]["wrong_answers"]


def test_robots_of_one_cell_are_refused_by_name() -> None:
    told = {
        "area": {"outline": [(0, 0), (4, 0), (4, 4), (0, 4)]},
        "places": {"a": {"x_m": 1.0, "y_m": 1.0, "heading_rad": 0}, "b": {"x_m": 3.0, "y_m": 3.0, "heading_rad": 0}},
        "task": {"kind": "goals", "goals": {"a": [(2.0, 2.0)], "b": [(2.05, 2.0)]}},
        "algorithm": {"use": "grid-ways"},
        "avoid": "plans",
        "duration_s": 2.0,
    }
    run = TeamRun(TeamScenario.model_validate(told))
    run.run()
    wrong = team_figures(run, 1.0)["algorithm"]["wrong_answers"]["a"]
    assert wrong["raised"] >= 3
    assert "in one cell with a" in wrong["first"]
