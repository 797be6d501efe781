"""The codec: every message as rosbags encodes its own, and nothing worse than a refusal for other bytes."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rosbags.interfaces import Nodetype

from tests.schemas.any_message import all_models, fields, models, quick
from touchline.schemas import messages
from touchline.schemas.cdr import NUMPY_CODES, decode, encode, typestore
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import Message


def native(description: Any, value: Any) -> Any:
    """``value`` of a model's field as rosbags' own message classes have it."""
    node, detail = description
    if node == Nodetype.NAME:
        own = {name: native(inner, getattr(value, name)) for name, inner in fields(detail)}
        return typestore().types[detail](**own)
    if node == Nodetype.BASE:
        return value
    inner, _ = detail
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return np.array(value, dtype=NUMPY_CODES[inner[1][0]])
    return [native(inner, item) for item in value]


@all_models
@quick(8)
@given(data=st.data())
def test_a_message_is_encoded_as_by_rosbags_and_no_part_of_it_is_one(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(models(kind))
    payload = encode(message)
    own = native((Nodetype.NAME, kind.ros_type), message)
    assert payload == bytes(typestore().serialize_cdr(own, kind.ros_type))
    assert decode(kind, payload) == message
    with pytest.raises(PayloadError):
        decode(kind, payload[: data.draw(st.integers(0, len(payload) - 1))])


@all_models
@quick(10)
@given(data=st.data())
def test_damaged_bytes_give_a_message_or_a_payload_error(kind: type[Message], data: st.DataObject) -> None:
    payload = bytearray(encode(data.draw(models(kind))))
    for position in data.draw(st.lists(st.integers(4, len(payload) - 1), max_size=4)) if len(payload) > 4 else []:
        payload[position] = data.draw(st.integers(0, 255))
    for damaged in (bytes(payload), bytes(payload[:4]) + data.draw(st.binary(max_size=200))):
        try:
            message = decode(kind, damaged)
        except PayloadError as error:
            assert str(error).startswith(kind.ros_type)
        else:
            assert encode(message)[:4] == b"\0\1\0\0"


@pytest.mark.parametrize("payload", [b"", b"\0\1\0", b"\xff\xff\0\0abcd", b"\0\3\0\0", bytes(40_000_000)], ids=len)
def test_what_is_not_cdr_is_refused(payload: bytes) -> None:
    with pytest.raises(PayloadError):
        decode(messages.Trajectory, payload)


def test_a_length_that_lies_is_refused_at_once() -> None:
    """A sequence that claims 4 billion elements must not be allocated."""
    for kind in (messages.GetPaintResponse, messages.Path, messages.DiagnosticArray):
        with pytest.raises(PayloadError):
            decode(kind, b"\0\1\0\0" + struct.pack("<I", 0xFFFFFFFF) * 8)


def test_values_outside_their_type_are_no_message() -> None:
    for make in (
        lambda: messages.Time(nanosec=1_000_000_000),
        lambda: messages.NavSatFix(position_covariance=[0.0] * 8),
        lambda: messages.PlanOptions(start=[0.0] * 4),
        lambda: messages.Event(severity=3),
    ):
        with pytest.raises(ValidationError):
            make()
