"""Many cases of one kind: some for every run of the tests, all of them for `make test-slow`."""

from collections.abc import Iterable
from typing import Any

import pytest


def one_in(share: int, cases: Iterable[Any]) -> list[Any]:
    """The cases, of which only every so manieth is not marked as slow."""
    return [
        case
        if number % share == 0
        else pytest.param(*case if isinstance(case, tuple) else (case,), marks=pytest.mark.slow)
        for number, case in enumerate(cases)
    ]
