"""Differing fields of two messages, and the size of the differences."""

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from touchline.recordings.decoding import decoder, field_names, fields_of
from touchline.recordings.recorded import Damage, Recorded
from touchline.recordings.schema_change import SchemaChange
from touchline.recordings.units import unit_of

_LONGEST_SHOWN = 80
_PLAIN = frozenset((float, int, str, bool))


class _Words(str):
    """Text that is shown as it stands, in place of a value."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class Unequal(NamedTuple):
    """Field that is not equal: its path, both values, and the size of the difference (inf: not a number)."""

    field: str
    left_value: object
    right_value: object
    size: float

    @property
    def left(self) -> str:
        """First value as text."""
        return _shown(self.left_value)

    @property
    def right(self) -> str:
        """Second value as text."""
        return _shown(self.right_value)

    @property
    def unit(self) -> str:
        """Unit of the values; empty if there is none."""
        return unit_of(self.field)


_NOTHING = _Words("nothing")


def unequal_fields(left: Recorded, right: Recorded, change: SchemaChange) -> list[Unequal]:
    """Return the common fields of two messages that are not equal; NaN equals NaN."""
    decode_left, decode_right = decoder(left.kind), decoder(right.kind)
    if decode_left is None or decode_right is None:
        return [] if left.payload == right.payload else [_as_bytes(left.payload, right.payload)]
    try:
        one, other = decode_left(left.payload), decode_right(right.payload)
    except Damage as damage:
        return [] if left.payload == right.payload else [Unequal("payload", _Words(damage), _Words(), math.inf)]
    found: list[Unequal] = []
    _walk("", one, other, change.left_only | change.right_only, found)
    return found


def _as_bytes(left: bytes, right: bytes) -> Unequal:
    first = next((i for i, (one, other) in enumerate(zip(left, right, strict=False)) if one != other), -1)
    place = f"byte {first}" if first >= 0 else "length"
    return Unequal(f"payload ({place})", _Words(f"{len(left)} bytes"), _Words(f"{len(right)} bytes"), math.inf)


def _walk(path: str, left: object, right: object, single: frozenset[str], found: list[Unequal]) -> None:
    """Add the differences below a path; `single` are fields that only one side's schema has."""
    kind: Any = type(left)
    names = field_names(kind)
    if names is not None and kind is type(right):
        for name in names:
            one, other = getattr(left, name), getattr(right, name)
            if not _plainly_equal(one, other):
                _walk(f"{path}.{name}" if path else name, one, other, single, found)
        return
    if type(left) is float and type(right) is float:
        _add_numbers(path, left, right, found)
        return
    ours, theirs = fields_of(left), fields_of(right)
    if ours is not None and theirs is not None:
        _add_of_other_schemas(path, (ours, theirs), single, found)
    elif isinstance(left, np.ndarray) and isinstance(right, np.ndarray) and len(left) == len(right):
        places = (left != right).nonzero()[0]
        for place, one, other in zip(places.tolist(), left[places].tolist(), right[places].tolist(), strict=True):
            _walk(f"{path}[{place}]", one, other, single, found)
    elif isinstance(left, (list, tuple, np.ndarray)) and isinstance(right, (list, tuple, np.ndarray)):
        if len(left) != len(right):
            found.append(Unequal(f"{path} (length)", len(left), len(right), math.inf))
            return
        for place, (one, other) in enumerate(zip(left, right, strict=True)):
            if not _plainly_equal(one, other):
                _walk(f"{path}[{place}]", one, other, single, found)
    elif _is_number(left) and _is_number(right) and (_is_float(left) or _is_float(right)):
        _add_numbers(path, float(left), float(right), found)  # type: ignore[arg-type]
    elif left != right:
        found.append(Unequal(path, left, right, math.inf))


def _add_of_other_schemas(
    path: str, both: tuple[Mapping[str, object], Mapping[str, object]], single: frozenset[str], found: list[Unequal]
) -> None:
    """Add the differences of fields by name, some of which only one side has."""
    ours, theirs = both
    for name in ours:
        place = f"{path}.{name}" if path else name
        if name in theirs:
            _walk(place, ours[name], theirs[name], single, found)
        elif not _of_schema(place, single):
            found.append(Unequal(place, ours[name], _NOTHING, math.inf))
    for name in theirs:
        place = f"{path}.{name}" if path else name
        if name not in ours and not _of_schema(place, single):
            found.append(Unequal(place, _NOTHING, theirs[name], math.inf))


def _plainly_equal(left: object, right: object) -> bool:
    """Return whether both are the same number, text or truth value, as most fields of most messages are."""
    return type(left) is type(right) and type(left) in _PLAIN and left == right


def _of_schema(place: str, single: frozenset[str]) -> bool:
    """Return whether the schemas already show that only one recording has the field."""
    plain = re.sub(r"\[\d*\]", "", place)
    return any(re.sub(r"\[\d*\]", "", field).startswith(plain) for field in single)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)


def _is_float(value: object) -> bool:
    return isinstance(value, (float, np.floating))


def _add_numbers(path: str, left: float, right: float, found: list[Unequal]) -> None:
    size = abs(left - right)
    if size > 0.0:
        found.append(Unequal(path, left, right, size))
    elif left != right and not (math.isnan(left) and math.isnan(right)):
        found.append(Unequal(path, left, right, math.inf))


def _shown(value: object) -> str:
    text = repr(value.item() if isinstance(value, np.generic) else value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
