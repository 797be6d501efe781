"""Sum of numbers that is the same in every version of Python."""

from collections.abc import Iterable
from functools import reduce
from operator import add


def plain_sum(values: Iterable[float]) -> float:
    """Add numbers one after another; the built-in `sum` compensates rounding errors from Python 3.12 on.

    Args:
        values: Any number of them.
    """
    return reduce(add, values, 0.0)
