"""Recorded messages as plain values: numbers, texts, lists and dicts by field name, as in JSON."""

import math
import re
from collections.abc import Iterator

import numpy as np

from touchline.recordings.decoding import decoder, fields_of
from touchline.recordings.recorded import Damage, Recorded
from touchline.schemas.errors import SpecError

_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


def values_of(message: Recorded) -> object:
    """Return the message's fields, by its recording's own schema; NaN and infinity are None, as in JSON.

    Raises:
        Damage: It cannot be decoded.
    """
    read = decoder(message.kind)
    if read is None:
        raise Damage(f"a payload in {message.kind.encoding or 'an unnamed encoding'}, which is not decoded here")
    return _plain(read(message.payload))


def _plain(node: object) -> object:
    fields = fields_of(node)
    if fields is not None:
        return {name: _plain(value) for name, value in fields.items()}
    if isinstance(node, np.ndarray):
        node = node.tolist()
    if isinstance(node, (list, tuple)):
        return [_plain(each) for each in node]
    if isinstance(node, np.generic):
        node = node.item()
    if isinstance(node, float) and not math.isfinite(node):
        return None
    return node.hex() if isinstance(node, bytes) else node


def at_path(values: object, path: str) -> object:
    """Return the value at ``path``, such as ``pose.position.x`` or ``x_m[3]``.

    Raises:
        SpecError: There is nothing.
    """
    found = values
    for name, number in _STEP.findall(path):
        if name and isinstance(found, dict) and name in found:
            found = found[name]
        elif number and isinstance(found, list) and int(number) < len(found):
            found = found[int(number)]
        else:
            has = f"give one of {', '.join(found)}" if isinstance(found, dict) else "leave out what follows"
            raise SpecError("the message", path, f"has no {name or f'element {number}'}", has)
    return found


def flat(values: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Yield (path, value) of every value that is no dict; a list of dicts is taken apart, too."""
    if isinstance(values, dict):
        for name, value in values.items():
            yield from flat(value, f"{path}.{name}" if path else str(name))
    elif isinstance(values, list) and any(isinstance(each, dict) for each in values):
        for number, value in enumerate(values):
            yield from flat(value, f"{path}[{number}]")
    else:
        yield path, values
