"""Statistic of a log: a number, or why the log does not tell it."""

from __future__ import annotations

from typing import NamedTuple


class Told(NamedTuple):
    """A statistic.

    Attributes:
        value: The number; None if the log does not tell it.
        untold: Why not; empty if there is a number.
    """

    value: float | None
    untold: str = ""
