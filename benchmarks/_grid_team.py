"""A team on a map of the MAPF benchmark, driven by emulated robots, of which some are late."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.mapf.grid_map import AgentGrid
from touchline.coordination.mapf.mapf_algorithm import GridWays
from touchline.schemas.team import TeamScenario
from touchline.team_algorithms import HOLD, Team, Wish

CELL_M = 0.6
SHRUNK_M = 0.02
"""Distance by which blocked cells are smaller, so that free cells that touch at a corner stay one area."""
BEYOND_M = 1.0

Ints = NDArray[np.int32]
Rectangle = list[tuple[float, float]]
REFINE_TURNS = 2000
LATE_S, LATE_WITHIN_S = 5.0, 30.0
"""Time for which a late robot stands, and latest time at which it begins to."""


class LateGridWays(GridWays):
    """Ways of all robots, of which a share stands for a while on the way."""

    def __init__(self, late: float) -> None:
        super().__init__(CELL_M, REFINE_TURNS)
        self._late = late
        self._stands_from_s: dict[str, float] = {}

    def decide(self, now: Team) -> Mapping[str, Wish]:
        wishes = super().decide(now)
        if not self._stands_from_s:
            rng, names = np.random.default_rng(next(iter(now.robots.values())).seed), list(wishes)
            chosen = rng.choice(len(names), round(self._late * len(names)), replace=False).tolist()
            self._stands_from_s = {names[who]: float(rng.uniform(0.0, LATE_WITHIN_S)) for who in chosen}
        stands = {name for name, from_s in self._stands_from_s.items() if from_s <= now.now_s < from_s + LATE_S}
        return {name: HOLD if name in stands else wish for name, wish in wishes.items()}


def team_on(grid: AgentGrid, starts: Ints, goals: Ints, seed: int, duration_s: float, use: str) -> TeamScenario:
    """Robots at the middles of their cells, headings at random, kept apart by plans, driven by an algorithm."""
    rng = np.random.default_rng(seed)
    middles = CELL_M * (grid.cells + 0.5)
    rows, columns = grid.number.shape
    names = [f"tb{number + 1}" for number in range(len(starts))]
    places, wanted = middles[starts].tolist(), middles[goals].tolist()
    turns = rng.uniform(-np.pi, np.pi, len(names)).tolist()
    told = {
        "area": {"outline": _rectangle(0.0, 0.0, columns * CELL_M, rows * CELL_M), "obstacles": _blocked(grid)},
        "places": {
            name: {"x_m": x, "y_m": y, "heading_rad": turn}
            for name, (x, y), turn in zip(names, places, turns, strict=True)
        },
        "task": {"kind": "goals", "goals": {name: [goal] for name, goal in zip(names, wanted, strict=True)}},
        "algorithm": {"use": use},
        "avoid": "plans",
        "duration_s": duration_s,
        "world": TeamScenario().world.model_copy(update={"seed": seed}).model_dump(),
    }
    return TeamScenario.model_validate(told)


def _rectangle(west: float, south: float, east: float, north: float) -> Rectangle:
    return [(west, south), (east, south), (east, north), (west, north)]


def _blocked(grid: AgentGrid) -> list[Rectangle]:
    """Rectangles of blocked cells beside each other in a row, beyond the border where they lie on it."""
    rows, columns = grid.number.shape
    found = []
    for row in range(rows):
        south = -BEYOND_M if row == 0 else row * CELL_M + SHRUNK_M
        north = rows * CELL_M + BEYOND_M if row == rows - 1 else (row + 1) * CELL_M - SHRUNK_M
        blocked = np.flatnonzero(np.diff(np.concatenate(([0], grid.number[row] < 0, [0]))))
        for first, end in blocked.reshape(-1, 2).tolist():
            west = -BEYOND_M if first == 0 else first * CELL_M + SHRUNK_M
            east = columns * CELL_M + BEYOND_M if end == columns else end * CELL_M - SHRUNK_M
            found.append(_rectangle(west, south, east, north))
    return found
