"""What is taken for a message without decoding it can be decoded; what cannot is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.schemas.any_message import all_models, models, quick
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import Clock, Message, String, Time
from touchline.schemas.wellformed import Wellformed


@all_models
@quick(10)
@given(data=st.data())
def test_a_payload_is_wellformed_if_and_only_if_it_can_be_decoded(kind: type[Message], data: st.DataObject) -> None:
    form, payload = Wellformed(kind), encode(data.draw(models(kind)))
    assert form.problem(payload) == ""
    assert form.problem(payload) == ""
    places = st.integers(0, len(payload) - 1)
    for at, value in data.draw(st.lists(st.tuples(places, st.integers(0, 255)), max_size=8)):
        damaged = payload[:at] + bytes([value]) + payload[at + 1 :]
        assert bool(form.problem(damaged)) == bool(_problem(kind, damaged))
    cut = payload[: data.draw(places)]
    assert form.problem(cut)


def _problem(kind: type[Message], payload: bytes) -> str:
    try:
        decode(kind, payload)
    except PayloadError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("nanosec", [1_000_000_000, 2**32 - 1])
def test_a_second_has_a_thousand_million_nanoseconds(nanosec: int) -> None:
    form = Wellformed(Clock)
    honest = encode(Clock(clock=Time(sec=1, nanosec=5)))
    assert form.problem(honest) == ""
    assert "nanosec" in form.problem(honest[:-4] + nanosec.to_bytes(4, "little"))


def test_of_a_large_payload_the_structure_counts() -> None:
    form, payload = Wellformed(String), encode(String(data="x" * 300_000))
    assert form.problem(payload) == ""
    assert "not a CDR message" in form.problem(payload[:-5])
