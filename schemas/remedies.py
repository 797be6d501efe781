"""Turns validation errors into a problem and a remedy, in the words of the file's author."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from touchline.schemas.given_angles import instead_of_degrees

Told = tuple[str, str]
"""(problem as a predicate, remedy)."""

_POINTS = frozenset({"start", "end", "center", "corners", "outline", "points", "corner", "opposite"})
"""Fields whose numbers are coordinates in m."""
_ANGLES = frozenset({"sweep_angle"})
_UNITS = {
    "m": "m",
    "rad": "rad",
    "deg": "degrees",
    "s": "s",
    "hz": "Hz",
    "mps": "m/s",
    "radps": "rad/s",
    "mps2": "m/s²",
    "kg": "kg",
    "l": "l",
    "t": "T",
    "wh": "Wh",
    "ppm": "ppm",
    "radps2": "rad/s²",
    "1pm": "1/m",
    "1pm2": "1/m²",
    "ohm": "Ω",
    "a": "A",
    "w": "W",
    "nm": "N m",
    "nms": "N m s",
    "kgm2": "kg m²",
}
_MISTAKEN: Mapping[str, Callable[[float], str]] = {
    "m": lambda given: " (in metres, not cm or mm)",
    "rad": lambda given: f" ({instead_of_degrees(given)})",
}
"""Unit in which a number that is far too large was probably meant."""
_ENDS = {"le": "at most", "ge": "at least", "lt": "less than", "gt": "more than"}
_TYPES = {
    "float_parsing": "a number",
    "float_type": "a number",
    "int_parsing": "a whole number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "string_type": "a text in quotes",
    "tuple_type": "a list in brackets",
    "finite_number": "a finite number",
}


def unit_of(location: tuple[int | str, ...]) -> str:
    """The unit of the number there, from the field's name; "" if it has none."""
    names = [part for part in location if isinstance(part, str)]
    if not names:
        return ""
    name = names[-1]
    if name in _POINTS:
        return "m"
    if name in _ANGLES:
        return "rad"
    measured, _, per = name.rpartition("_per_")
    if not measured:
        return _ending(name)
    above, below = _ending(measured), _UNITS.get(per, "")
    return f"{above} per {below}" if above and below else ""


def _ending(name: str) -> str:
    return _UNITS.get(name.rpartition("_")[2], "") if "_" in name else ""


def told(kind: str, location: tuple[int | str, ...], given: Any, context: Mapping[str, Any]) -> Told | None:
    """(problem, remedy) for a pydantic error; None if pydantic's own text is clear enough."""
    for end, words in _ENDS.items():
        if end in context:
            return f"is {_number(given)}", f"give {words} {_bound(context[end], unit_of(location), given, end)}"
    if kind in _TYPES:
        return f"is {given!r}", f"give {_TYPES[kind]}"
    teller = _TELLERS.get(kind)
    return teller(given, context) if teller else None


def _bound(bound: float, unit: str, given: Any, end: str) -> str:
    far = end in ("le", "lt") or (given < 0 and bound < 0)
    mistaken = _MISTAKEN[unit](given) if far and unit in _MISTAKEN else ""
    number = f"{bound:.10g}" if isinstance(bound, float) else str(bound)
    return f"{number}{' ' if unit else ''}{unit}{mistaken}"


def _number(given: Any) -> str:
    return f"{given:g}" if isinstance(given, float) and math.isfinite(given) else repr(given)


def _too_few_or_many(given: Any, context: Mapping[str, Any]) -> Told:
    count = len(given) if isinstance(given, list | tuple | str) else context["actual_length"]
    what = "characters" if isinstance(given, str) else "items"
    limit = f"at most {context['max_length']}" if "max_length" in context else f"at least {context['min_length']}"
    return f"has {count} {what}", f"give {limit}"


def _one_of(given: Any, context: Mapping[str, Any]) -> Told:
    return f"is {given!r}", f"give {context['expected']}"


_TELLERS: Mapping[str, Callable[[Any, Mapping[str, Any]], Told]] = {
    "too_short": _too_few_or_many,
    "too_long": _too_few_or_many,
    "string_too_short": _too_few_or_many,
    "string_too_long": _too_few_or_many,
    "literal_error": _one_of,
    "enum": _one_of,
}
