"""Teams by committed plans in passages and mazes: times, contacts, least distances of centres and of plans.

`python -m benchmarks team_passages`; `seeds` runs from the seed `first`, `mazes` mazes with `robots` robots each.

- Passages: a hall of 10 × 5 m is divided by a wall of 1 m; four robots on each side change sides. Starts are moved by
  up to ±8 cm and ±0.3 rad. The straight-line bound for 8 m is 17 s.
- Mazes: 6 × 6 cells, 2 m apart, corridors from 0.7 to 1.6 m wide.
"""

import math
from typing import Any

import numpy as np

from benchmarks._mazes import maze
from benchmarks._settings import Small
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.team import TeamScenario

WIDTHS_M = (0.7, 0.95, 1.2, 1.6, 2.4)
SMALL = Small(
    {"seeds": 1, "mazes": 1, "robots": 4},
    (
        "# seeds and # mazes from #",
        "after s, least median most ≤ 25 s arrived contacts in walls closest m plans m",
        *(f"passage {width_m} # # # # of # # of # # # # #" for width_m in WIDTHS_M),
        "maze # # # # of # # of # # # # #",
    ),
)
DURATION_S = 600.0


def main(seeds: int = 20, mazes: int = 20, robots: int = 20, first: int = 201) -> None:
    """Print a row for each kind of area."""
    print(f"{seeds} seeds and {mazes} mazes from {first}")
    print(f"{'':12}  after s, least  median   most    ≤ 25 s    arrived  contacts  in walls  closest m  plans m")
    for width_m in WIDTHS_M:
        _report(
            f"passage {width_m:4}", [_figures(_passage(seed, width_m), seed) for seed in range(first, first + seeds)]
        )
    _report("maze", [_figures(maze(seed, robots), seed) for seed in range(first, first + mazes)])


def _report(name: str, rows: list[tuple[float, ...]]) -> None:
    after_s, arrived, robots, contacts, in_walls_s, closest_m, plans_m = np.array(rows).T
    print(
        f"{name:12}  {after_s.min():14.1f}  {np.median(after_s):6.1f}  {after_s.max():5.1f}  "
        f"{(after_s <= 25.0).sum():2} of {len(rows):2}  {arrived.sum():4.0f} of {robots.sum():4.0f}  "
        f"{contacts.sum():8.0f}  {in_walls_s.sum():8.1f}  {closest_m.min():9.3f}  {plans_m.min():7.4f}",
        flush=True,
    )


def _figures(told: dict[str, Any], seed: int) -> tuple[float, ...]:
    """Time until all have arrived, robots that have, robots, contacts, time in walls, least distances of a run."""
    world = TeamScenario().world.model_copy(update={"seed": seed}).model_dump()
    team = TeamScenario.model_validate({**told, "avoid": "plans", "world": world, "duration_s": DURATION_S})
    run = TeamRun(team)
    run.run()
    figures = team_figures(run, 1.0)
    after_s = figures["goals"]["all_arrived_s"]
    return (
        math.inf if after_s is None else after_s,
        figures["goals"]["arrived"],
        len(run.names),
        figures["contacts"],
        figures["beyond_walls_robot_s"],
        figures["closest_m"],
        run.guide.believed.nearest_m,
    )


def _passage(seed: int, width_m: float) -> dict[str, Any]:
    """A team that changes sides of a passage."""
    rng, low, high = np.random.default_rng(seed), 2.5 - 0.5 * width_m, 2.5 + 0.5 * width_m
    walls = [[(4.5, y0), (5.5, y0), (5.5, y1), (4.5, y1)] for y0, y1 in ((0.0, low), (high, 5.0))]
    places, goals = {}, {}
    for number, y in enumerate((0.8, 1.9, 3.0, 4.1)):
        for side, x, heading in (("a", 1.0, 0.0), ("b", 9.0, math.pi)):
            dx, dy, turned = rng.uniform((-0.08, -0.08, -0.3), (0.08, 0.08, 0.3)).tolist()
            places[f"{side}{number}"] = {"x_m": x + dx, "y_m": y + dy, "heading_rad": heading + turned}
            goals[f"{side}{number}"] = [(10.0 - x, y)]
    area = {"outline": [(0, 0), (10, 0), (10, 5), (0, 5)], "obstacles": walls}
    return {"area": area, "places": places, "task": {"kind": "goals", "goals": goals}}
