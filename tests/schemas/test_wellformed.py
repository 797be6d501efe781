"""What is refused as a message without decoding it; that it is what cannot be decoded, test_cdr.py shows."""

import struct

import pytest

from touchline.schemas.cdr import encode
from touchline.schemas.messages import Clock, GotoRequest, PoseGoal, String, Time
from touchline.schemas.wellformed import Wellformed


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
