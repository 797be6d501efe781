"""Any message of any type, made from its message file."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, get_args

import annotated_types
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype

from touchline.schemas import messages
from touchline.schemas.cdr import typestore
from touchline.schemas.given_angles import FULL_TURN_RAD, AngleOrAny
from touchline.schemas.messages import Message

MODELS: dict[str, type[Message]] = {
    kind.ros_type: kind
    for kind in vars(messages).values()
    if isinstance(kind, type) and issubclass(kind, Message) and kind is not Message
}
LIMITS = {
    code: (0, 2 ** (8 * size) - 1) if unsigned else (-(2 ** (8 * size - 1)), 2 ** (8 * size - 1) - 1)
    for code, size, unsigned in (
        ("byte", 1, True),
        ("int8", 1, False),
        ("uint8", 1, True),
        ("int16", 2, False),
        ("uint16", 2, True),
        ("int32", 4, False),
        ("uint32", 4, True),
        ("int64", 8, False),
        ("uint64", 8, True),
    )
}


def fields(ros_type: str) -> list[tuple[str, Any]]:
    """(name, rosbags' description) of each field in the message file."""
    return list(typestore().fielddefs[ros_type][1])


def bounds(metadata: list[Any]) -> tuple[float, float]:
    """The range of integers that the constraints of a field admit."""
    lower = max([-math.inf, *(item.ge for item in metadata if isinstance(item, annotated_types.Ge))])
    upper = min(
        [
            math.inf,
            *(item.le for item in metadata if isinstance(item, annotated_types.Le)),
            *(item.lt - 1 for item in metadata if isinstance(item, annotated_types.Lt)),
        ]
    )
    return lower, upper


def numbers(primitive: str) -> st.SearchStrategy[Any]:
    """Any value of a primitive type."""
    if primitive in LIMITS:
        return st.integers(*LIMITS[primitive])
    if primitive == "bool":
        return st.booleans()
    return st.floats(width=32 if primitive == "float32" else 64)


def values(description: Any, metadata: list[Any]) -> st.SearchStrategy[Any]:
    """Anything that a field can hold."""
    node, detail = description
    if node == Nodetype.NAME:
        return models(MODELS[detail])
    if node == Nodetype.BASE:
        if detail[0] == "string":
            return st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=12)
        if detail[0] in LIMITS:
            lower, upper = bounds(metadata) if metadata else LIMITS[detail[0]]  # an array has no metadata of its own
            return st.integers(int(lower), int(upper))
        if list(get_args(AngleOrAny)[1:]) == metadata:
            return st.floats(-FULL_TURN_RAD, FULL_TURN_RAD) | st.just(math.nan)
        return numbers(detail[0])
    inner, count = detail
    shortest, longest = (count, count) if node == Nodetype.ARRAY else (0, count or 2)
    return st.lists(values(inner, []), min_size=shortest, max_size=longest)


@cache
def models(kind: type[Message]) -> st.SearchStrategy[Message]:
    """Any message of a type."""
    metadata = {name: field.metadata for name, field in kind.model_fields.items()}
    fitting = {name: values(description, metadata[name]) for name, description in fields(kind.ros_type)}
    return st.builds(kind, **fitting)


def quick(examples: int) -> Callable[[Any], Any]:
    """Few examples of each of many types."""
    checks = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]
    return settings(max_examples=examples, deadline=None, derandomize=True, suppress_health_check=checks)
