"""Refinement of moves: again and again a few agents are planned anew, one after another, between all others.

Large neighbourhood search with prioritised planning: Li, Chen, Harabor, Stuckey, Koenig, "Anytime multi-agent path
finding via large neighborhood search", IJCAI 2021. Most neighbourhoods are an agent that loses time and those in its
way, the others are chosen at random.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.mapf import refine_kernels as k
from touchline.coordination.mapf.lacam_kernels import AgentBoard

Ints = NDArray[np.int32]

_TOGETHER: Final = 8
"""Agents that are planned anew together, at most."""
_WAYS: Final = 10
"""Quicker ways on which those are looked for that are in an agent's way."""
_AT_RANDOM: Final = 0.3


def cost(board: AgentBoard, paths: Ints) -> int:
    """Return the sum over all agents of the steps until each stays at its goal, of paths (t, n)."""
    return sum(k.arrival(paths, who, goal) for who, goal in enumerate(board.goals.tolist()))


def refined(board: AgentBoard, paths: Ints, turns: int, seed: int = 0, headings: Ints | None = None) -> Ints:
    """Return moves (t, n) whose sum of steps is less, or the same ones.

    Args:
        board: Grid, goals and distances.
        paths: (t, n) cells of all agents at each step.
        turns: Number of neighbourhoods that are tried.
        seed: Seed of the choice.
        headings: (n,) of agents that take a step to turn to another neighbour, or two to turn round, as in `paths`: the
            neighbour that each faces at first. Of these the sum of squares becomes less, as the last ones count most.
    """
    rng = np.random.default_rng(seed)
    best, n = paths.copy(), paths.shape[1]
    space = _space(len(paths), len(board.neighbours), 1 if headings is None else k.HEADINGS)
    for who in range(n):
        k.put(space, best, who, who)
    arrivals = np.array([k.arrival(best, who, goal) for who, goal in enumerate(board.goals.tolist())])
    power, number = 1 if headings is None else 2, 0
    for _ in range(turns):
        chosen = _chosen(board, space, best, arrivals, rng)
        before = best[:, chosen].copy()
        for who in chosen:
            k.put(space, best, who, k.FREE)
        found = _anew(board, space, best, chosen, number, headings)
        number += len(chosen)
        if found is not None and (found**power).sum() <= (arrivals[chosen] ** power).sum():
            arrivals[chosen] = found
            continue
        for who in chosen if found is not None else ():
            k.put(space, best, who, k.FREE)
        for who, path in zip(chosen, before.T, strict=True):
            best[:, who] = path
            k.put(space, best, who, who)
    return best[: max(int(arrivals.max()) + 1, 1)]


def _anew(
    board: AgentBoard, space: k.SpaceTime, paths: Ints, chosen: list[int], number: int, headings: Ints | None
) -> Ints | None:
    """Plan agents anew in their order; return their arrivals, or None, their paths taken out, if one has no way."""
    found = []
    for place, who in enumerate(chosen):
        path, goal, search = paths[:, who].copy(), int(board.goals[who]), number + place + 1
        if headings is None:
            step = k.quickest(board.neighbours, board.left[who], space, path, goal, search)
        else:
            heading = int(headings[who])
            step = k.quickest_turning(board.neighbours, board.left[who], space, path, goal, heading, search)
        if step < 0:
            for done in chosen[:place]:
                k.put(space, paths, done, k.FREE)
            return None
        paths[:, who] = path
        k.put(space, paths, who, who)
        found.append(step)
    return np.array(found, dtype=np.int32)


def _chosen(board: AgentBoard, space: k.SpaceTime, paths: Ints, arrivals: Ints, rng: np.random.Generator) -> list[int]:
    """Return agents to be planned anew, in a random order."""
    n = paths.shape[1]
    most = min(_TOGETHER, n)
    lost = arrivals - board.left[np.arange(n), paths[0]]
    if rng.random() < _AT_RANDOM or not lost.any():
        chosen: list[int] = rng.choice(n, most, replace=False).tolist()
        return chosen
    who = int(rng.choice(n, p=lost / lost.sum()))
    found = np.empty(most, dtype=np.int32)
    path = np.ascontiguousarray(paths[: arrivals[who] + 1, who])
    count = k.blockers(board, space, path, who, rng.random((_WAYS, 2)), found)
    met: list[int] = rng.permutation(found[:count]).tolist()
    return met


def _space(steps: int, cells: int, headings: int) -> k.SpaceTime:
    """Return empty space over time."""
    return k.SpaceTime(
        np.full((steps, cells), k.FREE, dtype=np.int16),
        np.zeros((steps, cells * headings), dtype=np.int32),
        np.zeros((steps, cells * headings), dtype=np.int32),
        np.empty(steps, dtype=np.int32),
        np.empty(steps * cells * headings, dtype=np.int32),
    )
