"""The codec: every message as rosbags encodes its own, and nothing worse than a refusal for other bytes."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rosbags.interfaces import Nodetype

from tests.schemas.any_message import MODELS, fields, models, quick
from touchline.schemas import messages
from touchline.schemas.cdr import NUMPY_CODES, decode, encode, typestore
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import Clock, GotoRequest, Message, PoseGoal, String, Time
from touchline.schemas.wellformed import Wellformed


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


@quick(3)
@given(data=st.data())
def holds_for_any(kind: type[Message], form: Wellformed, data: st.DataObject) -> None:
    """A message of a type is encoded as by rosbags; its parts are none, and other bytes are one or a payload error."""
    message = data.draw(models(kind))
    payload = encode(message)
    assert payload == bytes(typestore().serialize_cdr(native((Nodetype.NAME, kind.ros_type), message), kind.ros_type))
    assert decode(kind, payload) == message
    assert form.problem(payload) == ""
    assert form.problem(payload) == ""
    places = st.integers(0, len(payload) - 1)
    cut = payload[: data.draw(places)]
    assert problem(kind, cut) and form.problem(cut)
    changes = data.draw(st.lists(st.tuples(places, st.integers(0, 255)), max_size=6))
    damaged = bytearray(payload)
    for place, value in changes:
        one = payload[:place] + bytes([value]) + payload[place + 1 :]
        assert bool(form.problem(one)) == bool(problem(kind, one))
        damaged[place] = value
    for other in (bytes(damaged), payload[:4] + data.draw(st.binary(max_size=200))):
        assert bool(form.problem(other)) == bool(problem(kind, other))


def problem(kind: type[Message], payload: bytes) -> str:
    """Fault of a payload; empty if it can be decoded."""
    try:
        message = decode(kind, payload)
    except PayloadError as error:
        assert str(error).startswith(kind.ros_type)
        return str(error)
    assert encode(message)[:4] == b"\0\1\0\0"
    return ""


def test_the_codec_and_what_is_taken_for_a_message_agree_with_rosbags() -> None:
    for kind in MODELS.values():
        holds_for_any(kind, Wellformed(kind))


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


@pytest.mark.parametrize("nanosec", [1_000_000_000, 2**32 - 1])
def test_a_second_has_a_thousand_million_nanoseconds(nanosec: int) -> None:
    form = Wellformed(Clock)
    honest = encode(Clock(clock=Time(sec=1, nanosec=5)))
    assert form.problem(honest) == ""
    assert "nanosec" in form.problem(honest[:-4] + nanosec.to_bytes(4, "little"))


def test_a_number_out_of_bounds_is_refused_after_one_within_them() -> None:
    form = Wellformed(GotoRequest)
    honest = GotoRequest(goal=PoseGoal(heading_rad=1.0))
    assert form.problem(encode(honest)) == ""
    degrees = encode(honest).replace(struct.pack("<d", 1.0), struct.pack("<d", 90.0))
    assert "radians" in form.problem(degrees)


def test_of_a_large_payload_the_structure_counts() -> None:
    form, payload = Wellformed(String), encode(String(data="x" * 300_000))
    assert form.problem(payload) == ""
    assert "not a CDR message" in form.problem(payload[:-5])
