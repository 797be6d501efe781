"""Moves of many agents on a grid to their goals, without collisions, found by LaCAM."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.mapf import lacam_kernels as k
from touchline.coordination.mapf.grid_map import AgentGrid
from touchline.schemas.errors import PlanningError

Ints = NDArray[np.int32]

_FIRST: Final = 1000
"""Configurations looked at in the first attempt…"""
_MOST: Final = 256_000
"""…and, if memory allows, in the last one."""
_MOST_NUMBERS: Final = 50_000_000
"""Cells of all agents in all configurations."""
_MORE: Final = 4


def board_of(grid: AgentGrid, goals: Ints) -> k.AgentBoard:
    """Return a grid with the distances from everywhere to goals (n,)."""
    v = len(grid.neighbours)
    left, queue = np.empty((len(goals), v), dtype=np.int32), np.empty(v, dtype=np.int32)
    for who, goal in enumerate(goals.tolist()):
        k.fill_distances(grid.neighbours, goal, left[who], queue)
    return k.AgentBoard(grid.neighbours, goals, left)


def solve(board: k.AgentBoard, starts: Ints, seed: int = 0) -> Ints:
    """Return cells (t, n) of all agents at each step, from their starts to their goals.

    Args:
        board: Grid, goals and distances.
        starts: (n,) cell of each agent.
        seed: Seed of ties; further attempts take others.

    Raises:
        PlanningError: Two start or end at the same cell, there is no way, or none was found.
    """
    for what, cells in {"start": starts, "end": board.goals}.items():
        if len(np.unique(cells)) < len(cells):
            raise PlanningError("", f"has agents that {what} at the same cell", "give each a cell of its own")
    if (board.left[np.arange(len(starts)), starts] >= len(board.neighbours)).any():
        raise PlanningError("", "has an agent without a way to its goal", "give goals that can be reached")
    n, v = len(starts), len(board.neighbours)
    most, attempt = _FIRST, 0
    while most <= _MOST and most * n <= _MOST_NUMBERS:
        search, step = _memory(n, most), _scratch(n, v)
        found = k.search_on(board, search, step, starts, seed + attempt, most)
        if found == -2:
            raise PlanningError("", "has no moves by which all get to their goals", "give other goals, or fewer agents")
        if found >= 0:
            return _backwards(search, found)
        most, attempt = most * _MORE, attempt + 1
    raise PlanningError("", f"took {most // _MORE:,} configurations without a result", "use fewer agents")


def _memory(n: int, most: int) -> k.Search:
    """Return memory for a search that looks at so many configurations of n agents."""
    slots = 1 << (2 * most).bit_length()
    followers, befores, depths, agents, cells = (np.empty(7 * most + 8, dtype=np.int32) for _ in range(5))
    parents, firsts, lasts = (np.empty(most + 1, dtype=np.int32) for _ in range(3))
    return k.Search(
        configurations=np.empty((most + 1, n), dtype=np.int32),
        priorities=np.empty((most + 1, n)),
        parents=parents,
        slots=np.empty(slots, dtype=np.int32),
        firsts=firsts,
        lasts=lasts,
        followers=followers,
        befores=befores,
        depths=depths,
        agents=agents,
        cells=cells,
        open=np.empty(most + 2, dtype=np.int32),
    )


def _scratch(n: int, v: int) -> k.MoveScratch:
    """Return scratch for a step of n agents on v cells."""
    agents = [np.empty(n, dtype=np.int32) for _ in range(6)]
    now, after, counts, tried, partners, stack = agents
    here, there = np.empty(v, dtype=np.int32), np.empty(v, dtype=np.int32)
    return k.MoveScratch(
        now, after, here, there, np.empty((n, k.MOST_CHOICES), dtype=np.int32), counts, tried, partners, stack
    )


def _backwards(search: k.Search, found: int) -> Ints:
    """Return the configurations (t, n) that lead to one."""
    numbers = [found]
    while (before := int(search.parents[numbers[-1]])) >= 0:
        numbers.append(before)
    return np.ascontiguousarray(search.configurations[numbers[::-1]])
