"""Moves of agents that take time to turn: a step for a quarter, in which they stay where they are."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.mapf.refine_kernels import HEADINGS

Ints = NDArray[np.int32]
Place = tuple[int, int]
"""Agent, and number of a cell in its route."""


def facing(headings_rad: NDArray[np.float64]) -> Ints:
    """Return the neighbour of `AgentGrid` that is nearest to being ahead, for headings counter-clockwise from x."""
    return (np.rint(1.0 - headings_rad / (0.5 * math.pi)) % HEADINGS).astype(np.int32)


def with_turns(neighbours: Ints, paths: Ints, headings: Ints) -> Ints:
    """Return moves in the same order with the steps that turning takes.

    Args:
        neighbours: (v, 4) as of `AgentGrid`.
        paths: (t, n) cells of all agents at each step.
        headings: (n,) neighbour that each faces at first.
    """
    routes, before = _routes(paths)
    sides = [[int(np.argmax(neighbours[a] == b)) for a, b in pairwise(route)] for route in routes]
    at, facing_now, turns = [0] * len(routes), headings.tolist(), [0] * len(routes)
    turned = [-1] * len(routes)
    rows = [paths[0]]
    while any(place < len(side) for place, side in zip(at, sides, strict=True)):
        moving = set()
        for who, place in enumerate(at):
            if place == len(sides[who]):
                continue
            if turned[who] != place:
                quarters = (sides[who][place] - facing_now[who]) % HEADINGS
                turns[who], turned[who], facing_now[who] = min(quarters, HEADINGS - quarters), place, sides[who][place]
            if turns[who]:
                turns[who] -= 1
            else:
                moving.add(who)
        while blocked := {who for who in moving if not _may_enter(before.get((who, at[who] + 1)), at, moving)}:
            moving -= blocked
        for who in moving:
            at[who] += 1
        rows.append(np.array([route[place] for route, place in zip(routes, at, strict=True)], dtype=np.int32))
    return np.array(rows)


def _routes(paths: Ints) -> tuple[list[list[int]], dict[Place, Place]]:
    """Return each agent's cells without waits, and who was before another at one of these, and where in its route."""
    routes, before = [[int(cell)] for cell in paths[0]], dict[Place, Place]()
    last: dict[int, Place] = {int(cell): (who, 0) for who, cell in enumerate(paths[0])}
    for now, after in pairwise(paths):
        for who in np.flatnonzero(now != after).tolist():
            cell, place = int(after[who]), (who, len(routes[who]))
            routes[who].append(cell)
            if cell in last:
                before[place] = last[cell]
            last[cell] = place
    return routes, before


def _may_enter(earlier: Place | None, at: list[int], moving: set[int]) -> bool:
    """Return whether the agent that was at a cell before has left it, or leaves it in this step."""
    return earlier is None or at[earlier[0]] + (earlier[0] in moving) > earlier[1]
