"""Which fields of two messages differ, and by how much."""

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from touchline.services.bridge.decoding import decoder, fields_of
from touchline.services.bridge.recorded import Damage, Recorded
from touchline.services.bridge.schema_change import SchemaChange
from touchline.services.bridge.units import unit_of

_LONGEST_SHOWN = 80
_PLAIN = frozenset((float, int, str, bool))


class Unequal(NamedTuple):
    """A field that is not equal: its path, both values, and the size of the difference (inf: no number)."""

    field: str
    left: str
    right: str
    size: float

    @property
    def unit(self) -> str:
        """Of the values; empty if they have none."""
        return unit_of(self.field)


def unequal_fields(left: Recorded, right: Recorded, change: SchemaChange) -> list[Unequal]:
    """The fields that two messages have in common and that are not equal; NaN equals NaN."""
    decode_left, decode_right = decoder(left.kind), decoder(right.kind)
    if decode_left is None or decode_right is None:
        return [] if left.payload == right.payload else [_as_bytes(left.payload, right.payload)]
    try:
        one, other = decode_left(left.payload), decode_right(right.payload)
    except Damage as damage:
        return [] if left.payload == right.payload else [Unequal("payload", str(damage), "", math.inf)]
    return list(_walk("", one, other, change.left_only | change.right_only))


def _as_bytes(left: bytes, right: bytes) -> Unequal:
    first = next((i for i, (one, other) in enumerate(zip(left, right, strict=False)) if one != other), -1)
    place = f"byte {first}" if first >= 0 else "length"
    return Unequal(f"payload ({place})", f"{len(left)} bytes", f"{len(right)} bytes", math.inf)


def _walk(path: str, left: object, right: object, single: frozenset[str]) -> Iterator[Unequal]:
    if _plainly_equal(left, right):
        return
    ours, theirs = fields_of(left), fields_of(right)
    if ours is not None and theirs is not None:
        for name in ours:
            if name in theirs and _plainly_equal(ours[name], theirs[name]):
                continue
            place = f"{path}.{name}" if path else name
            if name in theirs:
                yield from _walk(place, ours[name], theirs[name], single)
            elif not _of_schema(place, single):
                yield Unequal(place, _shown(ours[name]), "nothing", math.inf)
        for name in theirs:
            place = f"{path}.{name}" if path else name
            if name not in ours and not _of_schema(place, single):
                yield Unequal(place, "nothing", _shown(theirs[name]), math.inf)
    elif isinstance(left, (list, tuple, np.ndarray)) and isinstance(right, (list, tuple, np.ndarray)):
        if len(left) != len(right):
            yield Unequal(f"{path} (length)", str(len(left)), str(len(right)), math.inf)
            return
        if isinstance(left, np.ndarray) and isinstance(right, np.ndarray):
            places = np.flatnonzero(left != right)
        else:
            places = np.arange(len(left))
        for index in map(int, places):
            yield from _walk(f"{path}[{index}]", left[index], right[index], single)
    elif _is_number(left) and _is_number(right) and (_is_float(left) or _is_float(right)):
        yield from _numbers(path, float(left), float(right))  # type: ignore[arg-type]
    elif left != right:
        yield Unequal(path, _shown(left), _shown(right), math.inf)


def _plainly_equal(left: object, right: object) -> bool:
    """Whether both are the same number, text or truth value, as most fields of most messages are."""
    return type(left) is type(right) and type(left) in _PLAIN and left == right


def _of_schema(place: str, single: frozenset[str]) -> bool:
    """Whether the schemas already tell that only one recording has the field."""
    plain = re.sub(r"\[\d*\]", "", place)
    return any(re.sub(r"\[\d*\]", "", field).startswith(plain) for field in single)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)


def _is_float(value: object) -> bool:
    return isinstance(value, (float, np.floating))


def _numbers(path: str, left: float, right: float) -> Iterator[Unequal]:
    if left == right or (math.isnan(left) and math.isnan(right)):
        return
    size = abs(left - right)
    yield Unequal(path, repr(left), repr(right), math.inf if math.isnan(size) else size)


def _shown(value: object) -> str:
    text = repr(value.item() if isinstance(value, np.generic) else value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
