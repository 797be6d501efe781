"""Least size of a message of a foreign type, as a defence against types that unfold without end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rosbags.interfaces import Nodetype

from touchline.recordings.recorded import Damage

MOST_VALUES: Final = 1_000_000
"""Most values of a message, sequences counted once: an image of fixed size has less."""
_DEEPEST: Final = 32


def check_extent(described: Mapping[str, Any]) -> None:
    """Refuse types that have too many values, contain themselves, or are sequences of nothing.

    Args:
        described: rosbags' descriptions by type name.

    Raises:
        Damage: It names the type.
    """
    known: dict[str, int] = {}
    for name in described:
        values = _values(described, name, known, ())
        if values > MOST_VALUES:
            raise Damage(f"the type {name} with {values:,} values a message; at most {MOST_VALUES:,} are read")


def _values(described: Mapping[str, Any], name: str, known: dict[str, int], within: tuple[str, ...]) -> int:
    """Return the number of values in a message of a type."""
    if name in known:
        return known[name]
    if name in within or len(within) >= _DEEPEST:
        raise Damage(f"the type {name}, which contains itself or is nested too deeply")
    total = 0
    for _, (form, detail) in described[name][1]:
        many = form in (Nodetype.ARRAY, Nodetype.SEQUENCE)
        (kind, inner), count = detail if many else ((form, detail), 1)
        each = _values(described, inner, known, (*within, name)) if kind == Nodetype.NAME and inner in described else 1
        if form == Nodetype.SEQUENCE and not each:
            raise Damage(f"the type {name}, with a sequence of {inner}, which has no fields")
        total += each * (count if form == Nodetype.ARRAY else 1)
    known[name] = total
    return total
