"""Parameters of a test that `make test-full` adds to the usual ones."""

from collections.abc import Iterable
from typing import Any

import pytest


def with_full(*usual: Any, full: Iterable[Any]) -> list[Any]:
    """The usual ones, and more that are marked `full`; a tuple is one for each argument of the test."""
    more = (each if isinstance(each, tuple) else (each,) for each in full)
    return [*usual, *(pytest.param(*each, marks=pytest.mark.full) for each in more)]
