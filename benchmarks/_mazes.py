"""Mazes: random, connected, with corridors of different widths; and teams in them."""

import math
from itertools import pairwise
from typing import Any

import numpy as np

_CELLS = 6
_PITCH_M = 2.0
_LEAST_M, _MOST_M = 0.7, 1.6
_LOOPS = 0.15
"""Share of the walls between cells joined already that are opened as well."""


def maze(seed: int, robots: int) -> dict[str, Any]:
    """A team's area, places and task: from one cell of a maze to another each; no two robots have the same one."""
    import shapely

    rng = np.random.default_rng(seed)
    corridors = [_corridor(*ends, float(rng.uniform(_LEAST_M, _MOST_M))) for ends in _joined(rng)]
    free: Any = shapely.union_all(corridors)
    outline, *obstacles = [[*map(tuple, ring.coords[:-1])] for ring in (free.exterior, *free.interiors)]
    starts, goals = (rng.permutation(_CELLS * _CELLS)[:robots] for _ in range(2))
    places, wanted = {}, {}
    for number, (start, goal) in enumerate(zip(starts.tolist(), goals.tolist(), strict=True)):
        (x, y), name = _middle(start), f"tb{number:02}"
        places[name] = {"x_m": x, "y_m": y, "heading_rad": float(rng.uniform(-math.pi, math.pi))}
        wanted[name] = [_middle(goal)]
    area = {"outline": outline, "obstacles": obstacles}
    return {"area": area, "places": places, "task": {"kind": "goals", "goals": wanted}}


def _joined(rng: np.random.Generator) -> list[tuple[int, int]]:
    """Pairs of cells with a corridor between them, so that all are connected."""
    grid = np.arange(_CELLS * _CELLS).reshape(_CELLS, _CELLS)
    pairs = [pair for rows in (grid, grid.T) for row in rows.tolist() for pair in pairwise(row)]
    part, found = grid.ravel().copy(), []
    for number in rng.permutation(len(pairs)):
        a, b = pairs[number]
        if part[a] != part[b] or rng.random() < _LOOPS:
            part[part == part[b]] = part[a]
            found.append((a, b))
    return found


def _corridor(a: int, b: int, width_m: float) -> Any:
    """The ground of a corridor between two cells."""
    import shapely

    (x0, y0), (x1, y1) = sorted((_middle(a), _middle(b)))
    return shapely.box(x0 - 0.5 * width_m, y0 - 0.5 * width_m, x1 + 0.5 * width_m, y1 + 0.5 * width_m)


def _middle(cell: int) -> tuple[float, float]:
    """The middle of a cell (m)."""
    return _PITCH_M * (cell % _CELLS), _PITCH_M * (cell // _CELLS)
