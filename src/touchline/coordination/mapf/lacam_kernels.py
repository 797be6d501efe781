"""Kernels: moves of many agents on a grid, step by step, by LaCAM with PIBT.

*PIBT* moves all agents for a step: by priority each takes the free neighbour cell nearest to its goal; who stands
there inherits the priority and moves first, and an agent that finds nothing stays, which makes the one before try its
next cell. Agents that face each other in a dead end swap. *LaCAM* searches depth first over configurations of all
agents with PIBT for the next one; a configuration that is met again is continued with a constraint more, which agent
goes where, so that the search is complete. Okumura, Machida, Défago, Tamura, "Priority inheritance with backtracking
for iterative multi-agent path finding", Artificial Intelligence 310, 2022; Okumura, "LaCAM: search-based algorithm for
quick multi-agent pathfinding", AAAI 2023; swaps: Okumura, "Improving LaCAM for scalable eventually optimal multi-agent
pathfinding", IJCAI 2023.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import whole

Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Floats = NDArray[np.float64]

NOBODY: Final = -1
MOST_CHOICES: Final = 5
_TIES: Final = 1 << 20
_RESTARTS: Final = 1000
"""One of so many returns to a known configuration goes to the first one instead."""


class AgentBoard(NamedTuple):
    """Grid and goals.

    Attributes:
        neighbours: (v, 4) numbers of the cells beside each; −1: none.
        goals: (n,) cell of each agent.
        left: (n, v) steps from each cell to each agent's goal; v: not reached.
    """

    neighbours: Ints
    goals: Ints
    left: Ints


class MoveScratch(NamedTuple):
    """Scratch of one step.

    Attributes:
        now: (n,) cell of each agent.
        after: (n,) cell after the step; −1: not decided.
        here: (v,) agent on each cell; −1: nobody.
        there: (v,) agent on each cell after the step.
        choices: (n, 5) cells that each may take, the best first.
        counts: (n,) how many these are.
        tried: (n,) the one that is being tried.
        partners: (n,) agent with which each swaps; −1: none.
        stack: (n,) agents whose moves wait for others.
    """

    now: Ints
    after: Ints
    here: Ints
    there: Ints
    choices: Ints
    counts: Ints
    tried: Ints
    partners: Ints
    stack: Ints


@kernel
def fill_distances(neighbours: Ints, goal: int, left: Ints, queue: Ints) -> None:
    """Fill in the steps (v,) from every cell to a goal, breadth first; `queue` (v,) is scratch."""
    left[:] = len(left)
    left[goal], queue[0], end, at = 0, goal, 1, 0
    while at < end:
        cell = queue[at]
        at += 1
        for beside in neighbours[cell]:
            if beside >= 0 and left[beside] == len(left):
                left[beside] = left[cell] + 1
                queue[end] = beside
                end += 1


@kernel
def _onward(board: AgentBoard, step: MoveScratch, cell: int, before: int) -> int:
    """Return the only cell to which an agent that is pushed from `before` can go on; −1: none; −2: there are several.

    Dead ends in which an agent has arrived count as none.
    """
    found, count = NOBODY, 0
    for beside in board.neighbours[cell]:
        if beside < 0 or beside == before:
            continue
        who, degree = step.here[beside], 0
        for further in board.neighbours[beside]:
            degree += further >= 0
        if degree == 1 and who >= 0 and board.goals[who] == beside:
            continue
        found, count = beside, count + 1
    return -2 if count > 1 else found


@kernel
def _must_swap(board: AgentBoard, step: MoveScratch, pusher: int, pulled: int, pusher_at: int, pulled_at: int) -> bool:
    """Return whether two agents must change places: where one pushes the other on, neither gets to its goal."""
    left = board.left
    while left[pusher, pulled_at] < left[pusher, pusher_at]:
        further = _onward(board, step, pulled_at, pusher_at)
        if further == -2:
            return False
        if further < 0:
            break
        pusher_at, pulled_at = pulled_at, further
    nearer = left[pusher, pusher_at] == 0 or left[pusher, pulled_at] < left[pusher, pusher_at]
    return bool(left[pulled, pusher_at] < left[pulled, pulled_at] and nearer)


@kernel
def _can_swap(board: AgentBoard, step: MoveScratch, pusher_at: int, pulled_at: int) -> bool:
    """Return whether an agent that is pulled finds a cell with room for two to pass each other."""
    first = pusher_at
    while pulled_at != first:
        further = _onward(board, step, pulled_at, pusher_at)
        if further == -2:
            return True
        if further < 0:
            return False
        pusher_at, pulled_at = pulled_at, further
    return False


@kernel
def _partner(board: AgentBoard, step: MoveScratch, who: int) -> int:
    """Return the agent with which another must and can swap; −1: none."""
    here, wanted = step.now[who], step.choices[who, 0]
    if wanted == here:
        return NOBODY
    other = step.here[wanted]
    if (
        other >= 0
        and step.after[other] < 0
        and _must_swap(board, step, who, other, here, step.now[other])
        and _can_swap(board, step, step.now[other], here)
    ):
        return int(other)
    for beside in board.neighbours[here]:
        other = step.here[beside] if beside >= 0 else NOBODY
        if other < 0 or beside == wanted:
            continue
        if _must_swap(board, step, other, who, here, wanted) and _can_swap(board, step, wanted, here):
            return int(other)
    return NOBODY


@kernel
def _prepare(board: AgentBoard, step: MoveScratch, who: int, seed: int, drawn: Longs) -> None:
    """Sort the cells that an agent may take: nearest to its goal first, ties at random."""
    here, count = step.now[who], 0
    keys = np.empty(MOST_CHOICES)
    for at in range(MOST_CHOICES):
        cell = here if at == 4 else board.neighbours[here, at]
        if cell < 0:
            continue
        key = board.left[who, cell] + whole(seed, drawn[0], _TIES) / (2.0 * _TIES)
        drawn[0] += 1
        k = count
        while k > 0 and keys[k - 1] > key:
            keys[k], step.choices[who, k] = keys[k - 1], step.choices[who, k - 1]
            k -= 1
        keys[k], step.choices[who, k] = key, cell
        count += 1
    step.counts[who], step.tried[who] = count, 0
    partner = _partner(board, step, who)
    step.partners[who] = partner
    if partner >= 0:
        for k in range(count // 2):
            one, other = step.choices[who, k], step.choices[who, count - 1 - k]
            step.choices[who, k], step.choices[who, count - 1 - k] = other, one


@kernel
def _try_on(step: MoveScratch, who: int) -> int:
    """Let an agent take the next of its cells that is free.

    Returns:
        The agent that has to move before; −1: it has its cell; −2: there is none, so it stays.
    """
    while step.tried[who] < step.counts[who]:
        cell = step.choices[who, step.tried[who]]
        other = step.here[cell]
        if step.there[cell] >= 0 or (other >= 0 and step.after[other] == step.now[who]):
            step.tried[who] += 1
            continue
        step.there[cell], step.after[who] = who, cell
        return int(other) if other >= 0 and other != who and step.after[other] < 0 else -1
    step.there[step.now[who]], step.after[who] = who, step.now[who]
    return -2


@kernel
def _take(step: MoveScratch, who: int) -> None:
    """Let the partner of an agent that has its best cell follow it."""
    partner = step.partners[who]
    if step.tried[who] == 0 and partner >= 0 and step.after[partner] < 0 and step.there[step.now[who]] < 0:
        step.after[partner], step.there[step.now[who]] = step.now[who], partner


@kernel
def move(board: AgentBoard, step: MoveScratch, who: int, seed: int, drawn: Longs) -> bool:
    """Decide the move of an agent, and of all that have to move before.

    Args:
        board: Grid and goals.
        step: The step.
        who: Number of the agent.
        seed: Seed of ties.
        drawn: (1,) random numbers drawn so far.

    Returns:
        Whether it has a cell without breaking others' moves.
    """
    depth, moved, known = 0, False, False
    step.stack[0] = who
    _prepare(board, step, who, seed, drawn)
    while depth >= 0:
        top = step.stack[depth]
        if known and moved:
            _take(step, top)
            depth -= 1
            continue
        if known:
            step.tried[top] += 1
            known = False
        before = _try_on(step, top)
        if before >= 0:
            depth += 1
            step.stack[depth] = before
            _prepare(board, step, before, seed, drawn)
            continue
        known, moved = True, before == -1
        if moved:
            _take(step, top)
        depth -= 1
    return moved


class Search(NamedTuple):
    """Memory of a search: configurations, and constraints that are still to be tried with each.

    Attributes:
        configurations: (c, n) cells of all agents.
        priorities: (c, n)
        parents: (c,) configuration before; −1: the first.
        slots: (h,) hash table of configurations; −1: free. A power of two.
        firsts: (c,) next constraint of each configuration; −1: none is left.
        lasts: (c,) its last one.
        followers: (t,) constraint after each.
        befores: (t,) constraint that each adds to; −1: none.
        depths: (t,) number of agents that each constrains.
        agents: (t,) agent that it adds.
        cells: (t,) where that goes.
        open: (o,) stack of configurations.
    """

    configurations: Ints
    priorities: Floats
    parents: Ints
    slots: Ints
    firsts: Ints
    lasts: Ints
    followers: Ints
    befores: Ints
    depths: Ints
    agents: Ints
    cells: Ints
    open: Ints


@kernel
def _slot(search: Search, configuration: Ints) -> int:
    """Return the place of a configuration (n,) in the hash table, or the free one where it belongs."""
    key = np.uint64(1469598103934665603)
    for cell in configuration:
        key = (key ^ np.uint64(cell)) * np.uint64(1099511628211)
    most = np.uint64(len(search.slots) - 1)
    at = key & most
    while search.slots[at] >= 0 and not np.array_equal(search.configurations[search.slots[at]], configuration):
        at = (at + np.uint64(1)) & most
    return int(at)


@kernel
def _constrained(search: Search, step: MoveScratch, constraint: int) -> bool:
    """Set the moves that a constraint asks for; false if they break each other."""
    while search.depths[constraint] > 0:
        who, cell = search.agents[constraint], search.cells[constraint]
        other = step.here[cell]
        if step.there[cell] >= 0 or (other >= 0 and other != who and step.after[other] == step.now[who]):
            return False
        step.after[who], step.there[cell] = cell, who
        constraint = search.befores[constraint]
    return True


@kernel
def _moved(
    board: AgentBoard, search: Search, step: MoveScratch, at: tuple[int, int], order: Longs, seed: int, drawn: Longs
) -> bool:
    """Decide the moves of all agents by a constraint.

    Args:
        board: Grid and goals.
        search: Memory.
        step: The step; afterwards it has the moves.
        at: Numbers of the configuration and of the constraint.
        order: (n,) agents by priority.
        seed: Seed of ties.
        drawn: (1,) random numbers drawn so far.

    Returns:
        Whether there are such moves.
    """
    node, constraint = at
    step.now[:], step.after[:] = search.configurations[node], NOBODY
    step.here[:], step.there[:] = NOBODY, NOBODY
    for i in range(len(order)):
        step.here[step.now[i]] = i
    if not _constrained(search, step, constraint):
        return False
    for i in order:  # noqa: SIM110, which kernels cannot
        if step.after[i] < 0 and not move(board, step, i, seed, drawn):
            return False
    return True


@kernel
def search_on(board: AgentBoard, search: Search, step: MoveScratch, starts: Ints, seed: int, most: int) -> int:
    """Search for moves of all agents to their goals.

    Args:
        board: Grid and goals.
        search: Memory, for at least `most` configurations, and 6·`most` constraints.
        step: Scratch.
        starts: (n,) cell of each agent.
        seed: Seed of ties.
        most: Most configurations that are looked at.

    Returns:
        Number of the configuration in which all are at their goals, whose parents lead to the start; −1: none was
        found; −2: there is none.
    """
    n, v = len(starts), len(board.neighbours)
    drawn = np.zeros(1, np.int64)
    search.slots[:] = -1
    search.configurations[0], search.parents[0] = starts, -1
    for i in range(n):
        search.priorities[0, i] = board.left[i, starts[i]] / (v + 1.0)
    search.slots[_slot(search, starts)] = 0
    search.depths[0], search.befores[0], search.followers[0] = 0, -1, -1
    search.firsts[0] = search.lasts[0] = 0
    search.open[0] = 0
    known, constraints, top = 1, 1, 0
    for _ in range(most):
        if top < 0:
            return -2
        node = search.open[top]
        if np.array_equal(search.configurations[node], board.goals):
            return int(node)
        constraint = search.firsts[node]
        if constraint < 0:
            top -= 1
            continue
        search.firsts[node] = search.followers[constraint]
        order = np.argsort(-search.priorities[node], kind="mergesort")
        if search.depths[constraint] < n:
            who = order[search.depths[constraint]]
            here = search.configurations[node, who]
            begin = whole(seed, drawn[0], MOST_CHOICES)
            drawn[0] += 1
            for k in range(MOST_CHOICES):
                at = (begin + k) % MOST_CHOICES
                cell = here if at == 4 else board.neighbours[here, at]
                if cell < 0:
                    continue
                search.depths[constraints], search.befores[constraints] = search.depths[constraint] + 1, constraint
                search.agents[constraints], search.cells[constraints] = who, cell
                search.followers[constraints] = -1
                if search.firsts[node] < 0:
                    search.firsts[node] = constraints
                else:
                    search.followers[search.lasts[node]] = constraints
                search.lasts[node] = constraints
                constraints += 1
        if not _moved(board, search, step, (node, constraint), order, seed, drawn):
            continue
        slot = _slot(search, step.after)
        if search.slots[slot] >= 0:
            again = whole(seed, drawn[0], _RESTARTS) > 0
            drawn[0] += 1
            top += 1
            search.open[top] = search.slots[slot] if again else 0
            continue
        search.slots[slot] = known
        search.configurations[known], search.parents[known] = step.after, node
        for i in range(n):
            before = search.priorities[node, i]
            there = step.after[i] == board.goals[i]
            search.priorities[known, i] = before - np.floor(before) if there else before + 1.0
        search.depths[constraints], search.befores[constraints], search.followers[constraints] = 0, -1, -1
        search.firsts[known] = search.lasts[known] = constraints
        constraints += 1
        top += 1
        search.open[top] = known
        known += 1
    return -1
