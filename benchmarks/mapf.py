"""Ways of many agents on the maps of the MAPF benchmark: time to the first ones, and their length before and after.

`python -m benchmarks mapf data=FOLDER`: the folder has the maps and scenarios of the benchmark (Moving AI Lab), which
are not shipped. `refine_s`: time to shorten ways of 100 agents. `driven`: numbers of emulated robots that drive on the
map `on`, kept apart by plans; a share `late` of them stands for 5 s on the way. No answer is late by the clock. The
plan is what they drive by, in which a quarter turn takes a step; moves alone are the steps of its order without turns.
"""

import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks._grid_team import CELL_M, LATE_S, LateGridWays, team_on
from benchmarks._settings import NotHereError, Small
from touchline.coordination.algorithms import asking
from touchline.coordination.mapf.action_order import ActionOrder
from touchline.coordination.mapf.grid_map import read_map, read_scenario
from touchline.coordination.mapf.lacam import board_of, solve
from touchline.coordination.mapf.refine import cost, refined
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.plugins import TEAM_ALGORITHMS

SMALL = Small({"data": ""}, ())
MAPS = {
    "random-32-32-20": (50, 100, 200, 300, 409),
    "room-32-32-4": (50, 100, 200, 300),
    "warehouse-10-20-10-2-1": (100, 250, 500),
}
TURNS = 500
REFINED = 100
DURATION_S = 600.0


def main(
    data: str = "",
    seeds: int = 5,
    refine_s: float = 10.0,
    driven: str = "20,50,100",
    on: str = "random-32-32-20",
    late: float = 0.1,
) -> None:
    """Print a row for each map and number of agents, and for each team that drives."""
    if not data:
        raise NotHereError("the maps are not shipped: give data=FOLDER")
    print(f"{'map':24} agents  first ways s, median  most   steps  sum / least  refined")
    for name, sizes in MAPS.items() if seeds else ():
        grid = read_map(Path(data) / f"{name}.map")
        for agents in sizes:
            starts, goals = read_scenario(Path(data) / f"{name}-random-1.scen", grid, agents)
            board = board_of(grid, goals)
            least = int(board.left[np.arange(agents), starts].sum())
            solve(board, starts)  # loads the code
            took_s, found = [], []
            for seed in range(seeds):
                begun = time.perf_counter()
                found.append(solve(board, starts, 1000 * seed))
                took_s.append(time.perf_counter() - begun)
            shares = [cost(board, paths) / least for paths in found]
            paths, number, until_s = found[0], 0, time.perf_counter() + refine_s
            while agents == REFINED and time.perf_counter() < until_s:
                paths, number = refined(board, paths, TURNS, number), number + 1
            after = f"{cost(board, paths) / least:7.3f}" if number else ""
            print(
                f"{name:24} {agents:6}  {np.median(took_s):20.3f}  {max(took_s):5.3f}  {len(found[0]) - 1:5}  "
                f"{np.median(shares):11.2f}  {after}",
                flush=True,
            )
    for robots in [int(each) for each in driven.split(",") if each]:
        _drive(Path(data), on, robots, late)


def _drive(folder: Path, name: str, robots: int, late: float) -> None:
    """Print how emulated robots have driven."""
    grid, begun = read_map(folder / f"{name}.map"), time.perf_counter()
    starts, goals = read_scenario(folder / f"{name}-random-1.scen", grid, robots)
    ways = LateGridWays(late)
    TEAM_ALGORITHMS.register("late-ways", "of this benchmark", lambda: ways)
    run = TeamRun(team_on(grid, starts, goals, 1, DURATION_S, "late-ways"))
    with patch.object(asking, "perf_counter", return_value=0.0):
        run.run()
    TEAM_ALGORITHMS.forget("late-ways")
    assert ways.order is not None, "it has planned"
    step_s = CELL_M / run.team.vehicle.drive.transit_speed_mps
    plan_s, moves_s = ways.order.steps * step_s, _rounds(ways.order) * step_s
    figures = team_figures(run, time.perf_counter() - begun)
    arrived, after_s = figures["goals"]["arrived"], run.trace.ended_s
    print(
        f"{robots} robots on {name}, {late:.0%} late by {LATE_S:g} s: {arrived} arrived after {after_s:.1f} s, ", end=""
    )
    driven_s = after_s - LATE_S * (late > 0.0)
    print(f"{driven_s / plan_s:.2f} × plan ({plan_s:.1f} s) + delay, ", end="")
    print(f"{driven_s / moves_s:.2f} × moves alone ({moves_s:.1f} s) + delay, ", end="")
    print(f"{figures['contacts']} contacts, closest {figures['closest_m']:.3f} m, ", end="")
    changed = figures["intervention"]["changed_share"]
    print(f"{changed:.1%} of wishes changed; {figures['wall_time_s']:.0f} s of wall time", flush=True)


def _rounds(order: ActionOrder) -> int:
    """Return the steps until all are at their goals, if nobody has to turn."""
    reached, rounds = np.zeros(len(order.routes), dtype=np.int64), 0
    while (moves := np.array(order.horizons(reached)) > reached).any():
        reached, rounds = reached + moves, rounds + 1
    return rounds
