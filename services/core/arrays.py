"""What kernels do to whole arrays. Numba's own slice assignments, sums and sorts take long to compile."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel


@kernel
def copy(source: NDArray[Any], target: NDArray[Any]) -> None:
    """Give the first numbers of `target` (at least as many) the values of `source` (n,)."""
    for i in range(len(source)):
        target[i] = source[i]


@kernel
def least(values: NDArray[np.float64]) -> int:
    """The first place of the least of `values` (n,)."""
    place = 0
    for i in range(1, len(values)):
        if values[i] < values[place]:
            place = i
    return place


@kernel
def ascending(values: NDArray[np.float64], order: NDArray[np.int64]) -> None:
    """Fill `order` (n,) with the places of `values` (n,) from the least to the greatest: few of them."""
    for i in range(len(values)):
        j = i
        while j > 0 and values[order[j - 1]] > values[i]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i


@kernel
def count_up_to(values: NDArray[np.float64], limit: float) -> int:
    """How many of the ascending `values` (n,) are at most `limit`: the place right of them (``bisect_right``)."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if limit < values[middle]:
            high = middle
        else:
            low = middle + 1
    return low
