"""Grids for multi-agent path finding, and the benchmark's maps and scenarios (Stern et al., SoCS 2019)."""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.errors import SpecError
from touchline.schemas.spec import read_text

Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_FREE: Final = ".GS"
_STEPS: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))
_COLUMNS: Final = 9


class AgentGrid(NamedTuple):
    """Free cells of a grid, numbered row by row.

    Attributes:
        cells: (v, 2) column and row of each.
        number: (rows, columns) number of each cell; −1: not free.
        neighbours: (v, 4) numbers of the cells beside it; −1: none.
    """

    cells: Ints
    number: Ints
    neighbours: Ints

    @classmethod
    def of(cls, free: Bools) -> AgentGrid:
        """Number the free cells of a grid (rows, columns)."""
        number = np.full(free.shape, -1, dtype=np.int32)
        number[free] = np.arange(int(free.sum()), dtype=np.int32)
        row, column = np.nonzero(free)
        around = np.pad(number, 1, constant_values=-1)
        beside = [around[row + 1 + up, column + 1 + right] for right, up in _STEPS]
        cells = np.column_stack((column, row)).astype(np.int32)
        return cls(cells, number, np.ascontiguousarray(np.stack(beside, axis=1)))


def read_map(path: Path) -> AgentGrid:
    """Read a map of the benchmark.

    Raises:
        SpecError: The file cannot be read, or is no such map.
    """
    lines = read_text(path).splitlines()
    try:
        begin = lines.index("map") + 1
        height, width = (int(dict(line.split() for line in lines[: begin - 1])[key]) for key in ("height", "width"))
    except (ValueError, KeyError) as error:
        raise SpecError(path.name, "", "is no map", 'give a file with "height", "width" and "map"') from error
    rows = lines[begin : begin + height]
    if len(rows) != height or any(len(row) != width for row in rows):
        raise SpecError(path.name, "map", f"has not {height} rows of {width} characters", "give a complete file")
    return AgentGrid.of(np.array([[each in _FREE for each in row] for row in rows], dtype=np.bool_))


def read_scenario(path: Path, grid: AgentGrid, agents: int) -> tuple[Ints, Ints]:
    """Read starts and goals of the first agents of a scenario of the benchmark.

    Args:
        path: The file.
        grid: Its map.
        agents: Number of agents.

    Returns:
        (agents,) cells of their starts, and of their goals.

    Raises:
        SpecError: The file cannot be read, has fewer agents, or one is not on a free cell.
    """
    rows = [line.split() for line in read_text(path).splitlines()[1:] if line.strip()]
    if len(rows) < agents or any(len(row) < _COLUMNS for row in rows[:agents]):
        raise SpecError(path.name, "", f"has not {agents} agents", f"give a scenario with more, or up to {len(rows)}")
    try:
        numbers = np.array([[int(each) for each in row[4:8]] for row in rows[:agents]], dtype=np.int64)
        found = grid.number[numbers[:, 1], numbers[:, 0]], grid.number[numbers[:, 3], numbers[:, 2]]
    except (ValueError, IndexError) as error:
        raise SpecError(path.name, "", f"does not fit its map: {error}", "give the map that it names") from error
    if min(each.min() for each in found) < 0:
        raise SpecError(path.name, "", "has an agent on a cell that is not free", "give the map that it names")
    return found
