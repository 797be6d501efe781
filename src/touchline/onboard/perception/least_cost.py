"""Assignment of rows to columns at the least cost, in a kernel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def assign(cost: Floats, rows: int, columns: int, row_of: Integers, prices: Floats, way: Integers) -> None:
    """Assign rows to columns so that the sum of costs is least: the Hungarian method by shortest augmenting paths.

    R. Jonker, A. Volgenant, A shortest augmenting path algorithm for dense and sparse linear assignment problems,
    Computing 38, 1987.

    Args:
        cost: (rows or more, columns or more) costs.
        rows: Number of rows, at most that of columns.
        columns: Number of columns.
        row_of: (columns + 1 or more,) set to the row of each column, counted from 1 as the column is; 0: none.
        prices: (4, columns + 1 or more) memory.
        way: (columns + 1 or more,) memory.
    """
    row_price, column_price, least, done = prices[0], prices[1], prices[2], prices[3]
    for j in range(columns + 1):
        row_price[j] = column_price[j] = 0.0
        row_of[j] = 0
    for i in range(1, rows + 1):
        row_of[0] = i
        at = 0
        for j in range(columns + 1):
            least[j], done[j] = math.inf, 0.0
        while row_of[at] != 0:
            done[at] = 1.0
            row, delta, nearest = row_of[at], math.inf, 0
            for j in range(1, columns + 1):
                if done[j] == 1.0:
                    continue
                reduced = cost[row - 1, j - 1] - row_price[row] - column_price[j]
                if reduced < least[j]:
                    least[j], way[j] = reduced, at
                if least[j] < delta:
                    delta, nearest = least[j], j
            for j in range(columns + 1):
                if done[j] == 1.0:
                    row_price[row_of[j]] += delta
                    column_price[j] -= delta
                else:
                    least[j] -= delta
            at = nearest
        while at != 0:
            row_of[at] = row_of[way[at]]
            at = way[at]
