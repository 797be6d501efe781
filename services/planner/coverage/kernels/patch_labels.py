"""Connected patches of a raster."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel


@kernel
def label_patches(cells: NDArray[np.bool_]) -> Any:
    """Number the connected patches of a raster; cells that touch at a corner are connected.

    Args:
        cells: (m, n) cells that belong to patches.

    Returns:
        (m, n) number of each cell's patch, from 1 in the order of their first cells, row by row; 0 outside.
    """
    rows, columns = cells.shape
    numbers = np.zeros((rows, columns), np.int64)
    waiting = np.empty(cells.size, np.int64)
    count = 0
    for start in range(cells.size):
        if not cells[start // columns, start % columns] or numbers[start // columns, start % columns]:
            continue
        count += 1
        numbers[start // columns, start % columns] = count
        waiting[0], last = start, 0
        while last >= 0:
            row, column = waiting[last] // columns, waiting[last] % columns
            last -= 1
            for near in range(9):
                i, j = row + near // 3 - 1, column + near % 3 - 1
                if 0 <= i < rows and 0 <= j < columns and cells[i, j] and not numbers[i, j]:
                    numbers[i, j] = count
                    last += 1
                    waiting[last] = i * columns + j
    return numbers
