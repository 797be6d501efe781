"""A team on a map of the MAPF benchmark, driven by emulated robots."""

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.mapf.grid_map import AgentGrid
from touchline.schemas.team import TeamScenario

CELL_M = 0.6
SHRUNK_M = 0.02
"""Distance by which blocked cells are smaller, so that free cells that touch at a corner stay one area."""
BEYOND_M = 1.0

Ints = NDArray[np.int32]
Rectangle = list[tuple[float, float]]


def team_on(grid: AgentGrid, starts: Ints, goals: Ints, seed: int, duration_s: float) -> TeamScenario:
    """Robots at the middles of their cells, headings at random, kept apart by plans."""
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
        "algorithm": {"use": "grid-ways", "options": {"cell_m": CELL_M, "refine_turns": 2000}},
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
