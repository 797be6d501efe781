"""Fixed layouts: the same bytes as the codec's, and back."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.schemas.any_message import MODELS, models, quick
from touchline.schemas import messages
from touchline.schemas.cdr import encode, flat_fields
from touchline.schemas.errors import PayloadError
from touchline.schemas.layout import FixedLayout
from touchline.schemas.messages import Message


def has_flat_numbers(kind: type[Message]) -> bool:
    """Return whether a type has numbers and no arrays of messages, and so can have a fixed layout."""
    try:
        return any(primitive != "string" for _, primitive, _ in flat_fields(kind.ros_type))
    except TypeError:
        return False


FLAT = [kind for kind in MODELS.values() if has_flat_numbers(kind)]


def test_a_fixed_layout_packs_what_encode_encodes() -> None:
    for kind in FLAT:
        packs_any(kind)


@quick(2)
@given(data=st.data())
def packs_any(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(models(kind))
    leaves = [(path, primitive, count, leaf(message, path)) for path, primitive, count in flat_fields(kind.ros_type)]
    strings = {
        path: tuple(value) if count else value for path, primitive, count, value in leaves if primitive == "string"
    }
    lengths = {path: len(value) for path, primitive, count, value in leaves if primitive != "string" and count == -1}
    layout = FixedLayout(kind, strings, lengths)
    flat = [number for _, primitive, count, value in leaves if primitive != "string" for number in listed(value, count)]
    payload = encode(message)
    assert layout.pack(*flat) == payload
    assert np.array_equal(layout.unpack(payload), flat, equal_nan=True)
    assert layout.size == len(payload) and len(layout.leaves) == len(flat)
    if strings:
        with pytest.raises(PayloadError):
            layout.unpack(payload + b"\0")


def leaf(message: Message, path: str) -> Any:
    value: Any = message
    for name in path.split("."):
        value = getattr(value, name)
    return value


def listed(value: Any, count: int | None) -> list[Any]:
    return [value] if count is None else list(value)


def test_a_fixed_layout_refuses_fields_that_are_not_there() -> None:
    with pytest.raises(KeyError, match="frame"):
        FixedLayout(messages.Imu, {"frame": "map"}).pack()
    with pytest.raises(PayloadError, match="other frame"):
        FixedLayout(messages.Imu, {"header.frame_id": "abc"}).unpack(
            encode(messages.Imu(header=messages.Header(frame_id="xyz")))
        )
