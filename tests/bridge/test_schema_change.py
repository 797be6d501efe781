"""A comparison reads each recording by the schema that it has."""

import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.bridge.foreign import foreign
from touchline.recordings.compare import Comparison, compare
from touchline.recordings.decoding import as_message
from touchline.recordings.recorded import Recorded, RecordingKind
from touchline.schemas.cdr import encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import SegmentPaint, String

NOW = "float64 x_m\nfloat64 speed_mps\nstring[] names\n"
OLDER = "float64 x_m\nfloat64 speed_mps\n"
RENAMED = "float64 x_m\nfloat64 pace_mps\nstring[] names\n"
RETYPED = "float64 x_m\nfloat32 speed_mps\nstring[] names\n"
COMMENTED = "# Where it is.\nfloat64 x_m   # m\nfloat64 speed_mps\n\nstring[] names\n"


def payload(definition: str, values: dict[str, object]) -> bytes:
    """A message of type demo/msg/State."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, "demo/msg/State"))
    kind = store.types["demo/msg/State"]
    return bytes(store.serialize_cdr(kind(**values), "demo/msg/State"))


def state(path: Path, definition: str, x_m: float = 1.0) -> Path:
    fields = {"x_m": x_m, "speed_mps": 2.0, "pace_mps": 2.0, "names": ["a", "b"]}
    names = [line.split()[1] for line in definition.splitlines() if line.strip() and not line.startswith("#")]
    data = payload(definition, {name: fields[name] for name in names})
    return foreign(path, [("/state", 5, data)] * 3, type_="demo/msg/State", schema=definition)


def compared(folder: Path, left: str, right: str, *, x_m: float = 1.0) -> Comparison:
    return compare(state(folder / "old.mcap", left), state(folder / "new.mcap", right, x_m))


def test_a_renamed_field_is_a_difference_and_is_named(tmp_path: Path) -> None:
    result = compared(tmp_path, NOW, RENAMED)
    assert not result.same
    assert "/state: field speed_mps of old.mcap is called pace_mps in new.mcap" in list(result.lines())


def test_an_older_schema_is_compared_in_what_both_have(tmp_path: Path) -> None:
    result = compared(tmp_path, OLDER, NOW)
    assert result.same and not result.identical
    assert "/state: only new.mcap has the field names[]" in list(result.lines())
    other = compared(tmp_path, OLDER, NOW, x_m=1.5)
    assert not other.same
    assert any("x_m: 1.0 against 1.5 m" in line for line in other.lines())
    assert any("3 of 3 differ (largest 0.5 m in x_m)" in line for line in other.lines())


def test_another_type_of_a_field_is_a_difference(tmp_path: Path) -> None:
    result = compared(tmp_path, NOW, RETYPED)
    assert not result.same
    assert "/state: field speed_mps is float64 in old.mcap, float32 in new.mcap" in list(result.lines())


def test_comments_in_a_schema_are_no_difference(tmp_path: Path) -> None:
    assert compared(tmp_path, NOW, COMMENTED).identical


@pytest.mark.parametrize("text", ["the same", "another"])
def test_json_for_cdr_is_told_and_compared(tmp_path: Path, text: str) -> None:
    left = foreign(tmp_path / "a.mcap", [("/text", 5, encode(String(data="the same")))])
    said = [("/text", 5, json.dumps({"data": text}).encode())]
    right = foreign(tmp_path / "b.mcap", said, encoding="json", schema_encoding="jsonschema", schema="{}")
    result = compare(left, right)
    lines = list(result.lines())
    assert not result.same
    assert "/text: recorded as cdr in a.mcap, as json in b.mcap" in lines
    assert result.topics["/text"].different == (text == "another")


def test_what_nothing_here_decodes_is_compared_by_its_bytes(tmp_path: Path) -> None:
    def protobuf(name: str, data: bytes) -> Path:
        said = [("/p", 5, data)]
        return foreign(tmp_path / name, said, encoding="protobuf", schema_encoding="protobuf", schema="\x0a")

    assert compare(protobuf("a.mcap", b"12345"), protobuf("b.mcap", b"12345")).identical
    (difference,) = compare(tmp_path / "a.mcap", protobuf("c.mcap", b"12x45")).topics["/p"].first
    assert difference.field == "payload (byte 2)"


def test_a_schema_that_is_none_is_no_reason_to_fail(tmp_path: Path) -> None:
    data = np.arange(8, dtype=np.uint8).tobytes()
    paths = [
        foreign(tmp_path / f"{name}.mcap", [("/x", 5, data + name.encode())], type_="x/msg/Y", schema="}{ not one")
        for name in "ab"
    ]
    assert not compare(*paths).same
    assert compare(paths[0], paths[0]).identical


def recorded(schema: str, data: bytes, type_: str = "touchline_msgs/msg/SegmentPaint") -> Recorded:
    return Recorded("/tt2/line", 0, 0, 0, data, RecordingKind("cdr", type_, "ros2msg", schema))


def test_a_message_of_an_older_schema_has_defaults_for_what_it_lacks() -> None:
    older = "string id\nfloat64 length_m\n"
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(older, "touchline_msgs/msg/SegmentPaint"))
    kind = store.types["touchline_msgs/msg/SegmentPaint"]
    data = bytes(store.serialize_cdr(kind(id="a", length_m=2.0), "touchline_msgs/msg/SegmentPaint"))
    assert as_message(SegmentPaint, recorded(older, data)) == SegmentPaint(id="a", length_m=2.0)
    with pytest.raises(PayloadError):
        as_message(SegmentPaint, recorded(older, data[:9]))
    with pytest.raises(PayloadError):
        as_message(SegmentPaint, recorded("", data))
