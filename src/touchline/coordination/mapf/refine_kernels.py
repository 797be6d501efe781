"""Kernels: the quickest way of one agent through space and time, between the fixed moves of others."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.mapf.lacam_kernels import AgentBoard
from touchline.core.jit import kernel

Ints = NDArray[np.int32]
Shorts = NDArray[np.int16]
Floats = NDArray[np.float64]

FREE: Final = -1
STAYED: Final = 4
"""Choice of an agent that stays; the others are numbers of neighbours."""
HEADINGS: Final = 4
"""Headings of an agent that turns, each the number of the neighbour ahead."""


class SpaceTime(NamedTuple):
    """Occupied cells over time, and scratch of the search.

    Attributes:
        taken: (t, v) agent on each cell at each step; −1: nobody. What is there at the last step stays for ever.
        seen: (t, v·h) number of the search that has seen each, of agents that turn in each of h = 4 headings.
        came: (t, v·h) choice by which it did: 0 to 3 a neighbour, 4 stayed; of those that turn its heading before, from
            4 on with a move.
        heads: (l,) stack of places to look at, by the length of the whole way; −1: none.
        nexts: (t·v·h,) next place in the same stack.
    """

    taken: Shorts
    seen: Ints
    came: Ints
    heads: Ints
    nexts: Ints


@kernel
def put(space: SpaceTime, paths: Ints, who: int, value: int) -> None:
    """Enter an agent's path of paths (t, n), or with −1 take it out."""
    for step in range(len(paths)):
        space.taken[step, paths[step, who]] = value


@kernel
def _trace(neighbours: Ints, space: SpaceTime, path: Ints, step: int, goal: int) -> None:
    """Fill in a path that is at its goal from a step on."""
    path[step:] = goal
    cell = goal
    while step > 0:
        choice = space.came[step, cell]
        if choice < STAYED:
            cell = neighbours[cell, choice ^ 2]
        step -= 1
        path[step] = cell


@kernel
def _look_from(neighbours: Ints, left: Ints, space: SpaceTime, place: int, free_from: int, number: int) -> None:
    """Note where an agent can be a step later, by the length of the whole way.

    Args:
        neighbours: (v, 4) as of `AgentBoard`.
        left: (v,) steps from each cell to its goal.
        space: Occupied cells, and scratch.
        place: Step times the number of cells, and cell.
        free_from: Step from which on nobody crosses its goal.
        number: Number of this search.
    """
    most, v = space.taken.shape
    step, cell = place // v + 1, place % v
    for choice in range(STAYED + 1):
        to = cell if choice == STAYED else neighbours[cell, choice]
        if to < 0 or step >= most or space.seen[step, to] == number or space.taken[step, to] >= 0:
            continue
        other, length = space.taken[step - 1, to], max(step + left[to], free_from)
        if length >= most or (other >= 0 and other == space.taken[step, cell]):
            continue
        space.seen[step, to], space.came[step, to] = number, choice
        found = step * v + to
        space.nexts[found], space.heads[length] = space.heads[length], found


@kernel
def _free_from(space: SpaceTime, goal: int) -> int:
    """Return the step from which on nobody crosses a goal."""
    step = len(space.taken)
    while step > 0 and space.taken[step - 1, goal] < 0:
        step -= 1
    return step


@kernel
def quickest(neighbours: Ints, left: Ints, space: SpaceTime, path: Ints, goal: int, number: int) -> int:
    """Find the quickest way of an agent, A* over cells and steps; it stays at its goal from its arrival on.

    Args:
        neighbours: (v, 4) as of `AgentBoard`.
        left: (v,) steps from each cell to its goal.
        space: Occupied cells, without the agent.
        path: (t,) its present path, of which the first cell counts; filled in if there is a way.
        goal: Its goal.
        number: Number of this search.

    Returns:
        Step of its arrival; −1: there is no way within the time.
    """
    most, v = space.taken.shape
    free_from, first = _free_from(space, goal), path[0]
    begin = max(left[first], free_from)
    if begin >= most:
        return -1
    space.heads[:] = -1
    space.heads[begin], space.nexts[first], space.seen[0, first] = first, -1, number
    length = begin
    while length < most:
        place = space.heads[length]
        if place < 0:
            length += 1
            continue
        space.heads[length] = space.nexts[place]
        step = place // v
        if place % v == goal and step >= free_from:
            _trace(neighbours, space, path, step, goal)
            return int(step)
        _look_from(neighbours, left, space, place, free_from, number)
    return -1


@kernel
def _trace_turning(neighbours: Ints, space: SpaceTime, path: Ints, step: int, goal: int, heading: int) -> None:
    """Fill in a path that is at its goal, with a heading, from a step on."""
    path[step:] = goal
    cell = goal
    while step > 0:
        choice = space.came[step, cell * HEADINGS + heading]
        if choice >= HEADINGS:
            cell = neighbours[cell, heading ^ 2]
        heading = choice % HEADINGS
        step -= 1
        path[step] = cell


@kernel
def _look_from_turning(neighbours: Ints, left: Ints, space: SpaceTime, place: int, free_from: int, number: int) -> None:
    """Note where an agent that turns can be a step later, as of `_look_from`: a quarter turn takes a step."""
    most, v = space.taken.shape
    heading, cell, step = place % HEADINGS, place // HEADINGS % v, place // HEADINGS // v + 1
    if step >= most:
        return
    for choice in range(4):  # stays, turns to either side, moves
        to, after, came = cell, (heading + (0, 1, 3, 0)[choice]) % HEADINGS, heading
        if choice == 3:
            to, came = neighbours[cell, heading], heading + HEADINGS
            if to < 0 or (space.taken[step - 1, to] >= 0 and space.taken[step - 1, to] == space.taken[step, cell]):
                continue
        state = to * HEADINGS + after
        if space.taken[step, to] >= 0 or space.seen[step, state] == number:
            continue
        ahead = neighbours[to, after]
        turns = left[to] > 0 and (ahead < 0 or left[ahead] >= left[to])
        length = max(step + left[to] + turns, free_from)
        if length >= most:
            continue
        space.seen[step, state], space.came[step, state] = number, came
        found = step * v * HEADINGS + state
        space.nexts[found], space.heads[length] = space.heads[length], found


@kernel
def quickest_turning(
    neighbours: Ints, left: Ints, space: SpaceTime, path: Ints, goal: int, heading: int, number: int
) -> int:
    """Find the quickest way of an agent that turns, as of `quickest`, from a heading."""
    most, v = space.taken.shape
    free_from = _free_from(space, goal)
    first = path[0] * HEADINGS + heading
    length = max(left[path[0]], free_from)
    if length >= most:
        return -1
    space.heads[:] = -1
    space.heads[length], space.nexts[first], space.seen[0, first] = first, -1, number
    while length < most:
        place = space.heads[length]
        if place < 0:
            length += 1
            continue
        space.heads[length] = space.nexts[place]
        step = place // HEADINGS // v
        if place // HEADINGS % v == goal and step >= free_from:
            _trace_turning(neighbours, space, path, step, goal, place % HEADINGS)
            return int(step)
        _look_from_turning(neighbours, left, space, place, free_from, number)
    return -1


@kernel
def blockers(board: AgentBoard, space: SpaceTime, path: Ints, who: int, draws: Floats, found: Ints) -> int:
    """Collect the agents that are in the way of one that would leave its path for quicker ways.

    Args:
        board: Grid, goals and distances.
        space: Occupied cells.
        path: (t,) its path.
        who: Number of the agent.
        draws: (d, 2) random numbers in [0, 1): where each way begins, and which of its cells it prefers.
        found: (f,) filled in, itself first; no agent twice.

    Returns:
        How many these are.
    """
    left, count = board.left[who], 1
    found[0] = who
    for draw in range(len(draws)):
        step = int(draws[draw, 0] * (len(path) - 1))
        cell, turn = path[step], int(draws[draw, 1] * 4)
        while left[cell] > 0 and step + 1 < len(path):
            to = cell
            for choice in range(4):
                to = board.neighbours[cell, (choice + turn) % 4]
                if to >= 0 and left[to] < left[cell]:
                    break
            other = space.taken[step, to] if space.taken[step + 1, to] < 0 else space.taken[step + 1, to]
            if other >= 0 and not (found[:count] == other).any():
                found[count] = other
                count += 1
                if count == len(found):
                    return count
            cell, step = to, step + 1
    return count


@kernel
def arrival(paths: Ints, who: int, goal: int) -> int:
    """Return the step from which on an agent of paths (t, n) stays at its goal."""
    step = len(paths)
    while step > 0 and paths[step - 1, who] == goal:
        step -= 1
    return step
