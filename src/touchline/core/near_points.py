"""Pairs of points that are near each other."""

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray


def near_pairs(first: NDArray[np.float64], second: NDArray[np.float64], within_m: float) -> NDArray[np.intp]:
    """Find pairs of rows (n, 2) of two arrays of points (k, 2) within a distance, in ascending order.

    Args:
        first: (k, 2) points (m).
        second: (l, 2) points (m).
        within_m: Maximum distance.
    """
    tree = shapely.STRtree(np.asarray(shapely.points(second)))
    rows: NDArray[Any] = tree.query(shapely.points(first), predicate="dwithin", distance=within_m)
    return np.asarray(rows.T[np.lexsort(rows[::-1])])
