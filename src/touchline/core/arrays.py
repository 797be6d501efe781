"""Array operations for kernels. Numba's own slice assignments, sums and sorts take long to compile."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel


@kernel
def copy(source: NDArray[Any], target: NDArray[Any]) -> None:
    """Copy an array into the start of another.

    Args:
        source: (n,).
        target: (n or more,) its first n are overwritten.
    """
    for i in range(len(source)):
        target[i] = source[i]


@kernel
def copy_rows(source: NDArray[Any], target: NDArray[Any], count: int) -> None:
    """Copy the first rows of an array into those of another.

    Args:
        source: (`count` or more, k).
        target: (`count` or more, k) its first `count` rows are overwritten.
        count: Number of rows.
    """
    for i in range(count):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@kernel
def least(values: NDArray[np.float64]) -> int:
    """Index of the minimum of `values` (n,), the first one of equals."""
    place = 0
    for i in range(1, len(values)):
        if values[i] < values[place]:
            place = i
    return place


@kernel
def ascending(values: NDArray[np.float64], order: NDArray[np.int64]) -> None:
    """Sort the indices of an array by its values, by stable insertion: for few values.

    Args:
        values: (n,).
        order: (n,) filled with the indices of the values in ascending order.
    """
    for i in range(len(values)):
        j = i
        while j > 0 and values[order[j - 1]] > values[i]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i


@kernel
def count_up_to(values: NDArray[np.float64], limit: float) -> int:
    """Number of values that are at most a limit, by bisection, as `bisect.bisect_right`.

    Args:
        values: (n,) ascending.
        limit: Limit in the unit of the values.
    """
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if limit < values[middle]:
            high = middle
        else:
            low = middle + 1
    return low
