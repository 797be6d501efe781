"""Team algorithm that plans the ways of all robots to their goals together, on a grid, and drives them in its order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.algorithms.team_algorithm import HOLD, Me, PathWish, Team, Wish
from touchline.coordination.free_area import FreeArea
from touchline.coordination.mapf.action_order import ActionOrder
from touchline.coordination.mapf.grid_map import AgentGrid
from touchline.coordination.mapf.lacam import board_of, solve
from touchline.coordination.mapf.refine import refined
from touchline.coordination.mapf.turning import facing, with_turns
from touchline.schemas.errors import SpecError

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_CELL_R: Final = 2.0 * math.sqrt(2.0)
"""Least side of a cell in clearance radii: of two discs one passes a corner while the other leaves the cell beyond."""
_ROOM_M: Final = 0.02
_REACHED: Final = 1.0 / 3.0
"""Distance from a cell's middle, in cells, at which a robot counts as being there."""


class GridWays:
    """Ways of all robots, found anew when a goal changes.

    The area is laid out in square cells; robots without a goal stay in theirs. On the way a robot is sent as far as
    nobody has to pass before it; at its last cell it drives to the goal itself.

    Attributes:
        order: The order of their moves; None before the first update.
    """

    def __init__(self, cell_m: float = 0.0, refine_turns: int = 200) -> None:
        """Plan on cells of a side.

        Args:
            cell_m: Side of a cell; 0: the least for the robots' clearance.
            refine_turns: Attempts to shorten the ways, each time that a goal changes.
        """
        self._cell_m, self._refine_turns = cell_m, refine_turns
        self._grid: AgentGrid | None = None
        self._corner = np.zeros(2)
        self._goals: dict[str, tuple[float, float] | None] = {}
        self.order: ActionOrder | None = None
        self._reached = np.zeros(0, dtype=np.int64)

    def decide(self, now: Team) -> Mapping[str, Wish]:
        """Return wishes, as of `TeamAlgorithm`.

        Raises:
            SpecError: Two robots stand in one cell or have goals in one, or one is not within the grid.
            PlanningError: There are no such ways.
        """
        robots = list(now.robots.values())
        goals = {me.name: me.goal_m for me in robots}
        if self.order is None or goals != self._goals:
            self.order = self._planned(robots)
            self._reached, self._goals = np.zeros(len(robots), dtype=np.int64), goals
        self._advance(self.order, robots)
        ends = self.order.horizons(self._reached)
        return {me.name: self._wish(self.order.routes[who], who, ends[who], me) for who, me in enumerate(robots)}

    def _planned(self, robots: Sequence[Me]) -> ActionOrder:
        grid = self._laid_out(robots[0].area, robots[0].radius_m)
        places = np.array([(me.x_m, me.y_m) for me in robots])
        wanted = np.array([me.goal_m or (me.x_m, me.y_m) for me in robots])
        names = [me.name for me in robots]
        starts, ends = self._cells(grid, places, names, "stands"), self._cells(grid, wanted, names, "has its goal")
        board = board_of(grid, ends)
        turns, seed = self._refine_turns, robots[0].seed
        paths = refined(board, solve(board, starts, seed), turns, seed)
        headings = facing(np.array([me.heading_rad for me in robots]))
        return ActionOrder(refined(board, with_turns(grid.neighbours, paths, headings), turns, seed, headings))

    def _laid_out(self, area: FreeArea, radius_m: float) -> AgentGrid:
        """Return the grid: cells in whose middle a robot keeps clear of walls."""
        if self._grid is None:
            least_m = _CELL_R * radius_m
            self._cell_m = self._cell_m or least_m
            if self._cell_m < least_m - 1e-9:
                problem = f"is {self._cell_m:g} m, too little for two robots that pass a corner"
                raise SpecError("team", "algorithm.options.cell_m", problem, f"give at least {least_m:.3f}")
            low, high = area.hull.min(axis=0), area.hull.max(axis=0)
            columns, rows = (max(int(n), 1) for n in np.floor((high - low) / self._cell_m + 1e-9))
            self._corner = low + 0.5 * (high - low - self._cell_m * np.array((columns, rows)))
            column, row = np.meshgrid(np.arange(columns), np.arange(rows))
            middles = self._middle(np.stack((column, row), axis=2).reshape(-1, 2))
            free = area.holds(middles, radius_m).reshape(rows, columns)
            self._grid = _without_walls_between(
                AgentGrid.of(free), middles, free, area.shape.buffer(_ROOM_M - radius_m)
            )
        return self._grid

    def _middle(self, cells: NDArray[np.int64] | Ints) -> Floats:
        """Return (n, 2) middles of cells (n, 2) by column and row (m)."""
        found: Floats = self._corner + self._cell_m * (cells + 0.5)
        return found

    def _cells(self, grid: AgentGrid, places: Floats, names: Sequence[str], what: str) -> Ints:
        """Return the free cell of each place (n, 2) m.

        Raises:
            SpecError: There is none, or it is another's.
        """
        at = np.floor((places - self._corner) / self._cell_m).astype(np.int64)
        rows, columns = grid.number.shape
        at = np.clip(at, 0, (columns - 1, rows - 1))
        found = grid.number[at[:, 1], at[:, 0]]
        owner: dict[int, str] = {}
        for name, place, cell in zip(names, places.tolist(), found.tolist(), strict=True):
            where = f"{what} at ({place[0]:.2f}, {place[1]:.2f}) m"
            if cell < 0:
                raise SpecError(
                    "team", f"robot {name}", f"{where}, in no free cell of the grid", "move it off the wall"
                )
            if cell in owner:
                raise SpecError("team", f"robot {name}", f"{where}, in one cell with {owner[cell]}", "move them apart")
            owner[cell] = name
        return found

    def _advance(self, order: ActionOrder, robots: Sequence[Me]) -> None:
        """Note how far each robot has come along its route: to the middle of a cell, or to its goal."""
        for who, (me, end) in enumerate(zip(robots, order.horizons(self._reached), strict=True)):
            ahead = self._ahead(order.routes[who], who, end, me)
            near = np.flatnonzero(np.hypot(*(ahead - (me.x_m, me.y_m)).T) <= _REACHED * self._cell_m)
            last = len(order.routes[who]) - 1 - int(self._reached[who])
            self._reached[who] += min(int(near[-1]), last) if len(near) else 0

    def _ahead(self, route: Sequence[int], who: int, end: int, me: Me) -> Floats:
        """Return (p, 2) places of a route to its end now, from a robot's cell on, with its goal behind the last (m)."""
        assert self._grid is not None, "it is laid out"
        middles = self._middle(self._grid.cells[route[int(self._reached[who]) : end + 1]])
        return np.vstack((middles, me.goal_m)) if end == len(route) - 1 and me.goal_m else middles

    def _wish(self, route: Sequence[int], who: int, end: int, me: Me) -> Wish:
        if int(self._reached[who]) == len(route) - 1:
            return PathWish([me.goal_m]) if me.goal_m else HOLD
        return PathWish([(x, y) for x, y in self._ahead(route, who, end, me).tolist()])


def _without_walls_between(grid: AgentGrid, middles: Floats, free: NDArray[np.bool_], room: Any) -> AgentGrid:
    """Return a grid whose cells are neighbours only if the straight way between them keeps clear of walls."""
    import shapely

    at = middles[free.ravel()]
    cell, side = np.nonzero(grid.neighbours >= 0)
    ways = shapely.linestrings(np.stack((at[cell], at[grid.neighbours[cell, side]]), axis=1))
    shapely.prepare(room)
    grid.neighbours[cell, side] = np.where(shapely.covers(room, ways), grid.neighbours[cell, side], -1)
    return grid
