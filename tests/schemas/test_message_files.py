"""The shipped ``.msg``/``.srv`` files, the pydantic models and the CDR codec say the same thing."""

import math
import struct
from collections.abc import Callable
from typing import Any, get_args, get_origin

import annotated_types
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from rosbags.interfaces import Nodetype

from schemas import messages
from schemas.cdr import NUMPY_CODES, decode, definition_files, encode, flat_fields, type_hash, typestore
from schemas.errors import PayloadError
from schemas.layout import FixedLayout
from schemas.messages import Message

MODELS: dict[str, type[Message]] = {
    kind.ros_type: kind
    for kind in vars(messages).values()
    if isinstance(kind, type) and issubclass(kind, Message) and kind is not Message
}
SHIPPED = {name for name, _ in definition_files()}
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
all_models = pytest.mark.parametrize("kind", list(MODELS.values()), ids=list(MODELS))

#: The robot's packages, as they are known from its maker: (field, type) in order.
TURF_TANK = {
    "tt_trajectory_msgs/msg/Trajectory": (
        "path Path, actuation_profile ActuationProfile, velocity_profile VelocityProfile"
    ),
    "tt_trajectory_msgs/msg/Path": "segments Segment[]",
    "tt_trajectory_msgs/msg/Segment": "id string, label string, curve Curve, direction LinearDirection",
    "tt_geometry_msgs/msg/Curve": "type CurveType, line Line[<=1], arc Arc[<=1]",
    "tt_geometry_msgs/msg/CurveType": "value uint8",
    "tt_geometry_msgs/msg/Line": "start Point, end Point",
    "tt_geometry_msgs/msg/Arc": "start Point, center Point, sweep_angle float64",
    "tt_geometry_msgs/msg/LinearDirection": "value int8",
    "tt_trajectory_msgs/msg/ActuationProfile": "parameters PathActuationParameter[]",
    "tt_trajectory_msgs/msg/PathActuationParameter": "arc_length float64, actuation Actuation",
    "tt_trajectory_msgs/msg/Actuation": "value uint8",
    "tt_trajectory_msgs/msg/VelocityProfile": "parameters PathVelocityParameter[]",
    "tt_trajectory_msgs/msg/PathVelocityParameter": "arc_length float64, velocity Velocity",
    "tt_trajectory_msgs/msg/Velocity": "type VelocityType, value float64",
    "tt_trajectory_msgs/msg/VelocityType": "value uint8",
    "tt_trajectory_msgs/srv/StartTraversal_Request": "trajectory Trajectory",
    "tt_trajectory_msgs/srv/StartTraversal_Response": "total_time float64, success bool",
}
TURF_TANK_CONSTANTS = {
    "tt_geometry_msgs/msg/CurveType": {"NONE": 0, "LINE": 1, "ARC": 2},
    "tt_geometry_msgs/msg/LinearDirection": {"BACKWARD": -1, "NONE": 0, "FORWARD": 1},
    "tt_trajectory_msgs/msg/Actuation": {
        "NONE": 0,
        "PUMP": 1,
        "VALVE": 2,
        "SPRAY": 3,
        "DISC": 4,
        "DISC_SPRAY": 7,
        "ALL": 7,
    },
    "tt_trajectory_msgs/msg/VelocityType": {"NONE": 0, "LINEAR": 1, "ANGULAR": 2},
}


def fields(ros_type: str) -> list[tuple[str, Any]]:
    """(name, rosbags' description) of each field in the message file."""
    return list(typestore().fielddefs[ros_type][1])


def written(description: Any) -> str:
    """A field type as message files write it, without packages."""
    node, detail = description
    if node == Nodetype.NAME:
        return str(detail).rsplit("/", 1)[1]
    if node == Nodetype.BASE:
        return str(detail[0])
    inner, count = detail
    if node == Nodetype.ARRAY:
        return f"{written(inner)}[{count}]"
    return f"{written(inner)}[<={count}]" if count else f"{written(inner)}[]"


def integers(ros_type: str) -> dict[str, int]:
    """The constants in the message file."""
    return {name: value for name, _, value in typestore().fielddefs[ros_type][0]}


# --- the files and the models ---


def test_every_file_has_a_model_and_every_model_of_ours_a_file() -> None:
    ours = {name for name in MODELS if name.startswith(("tt_", "touchline_msgs/"))}
    assert ours == SHIPPED
    assert len(MODELS) > len(SHIPPED) >= 40


@pytest.mark.parametrize("ros_type", TURF_TANK)
def test_the_robots_own_tree_is_exact(ros_type: str) -> None:
    assert ", ".join(f"{name} {written(kind)}" for name, kind in fields(ros_type)) == TURF_TANK[ros_type]
    assert integers(ros_type) == TURF_TANK_CONSTANTS.get(ros_type, {})


@all_models
def test_a_model_has_the_fields_of_its_file_in_order(kind: type[Message]) -> None:
    assert list(kind.model_fields) == [name for name, _ in fields(kind.ros_type)]


@all_models
def test_a_models_field_types_are_those_of_its_file(kind: type[Message]) -> None:
    for name, description in fields(kind.ros_type):
        field = kind.model_fields[name]
        assert_type(f"{kind.ros_type}.{name}", description, field.annotation, field.metadata)


def assert_type(place: str, description: Any, annotation: Any, metadata: list[Any]) -> None:
    node, detail = description
    if node == Nodetype.NAME:
        assert annotation.ros_type == detail, place
    elif node == Nodetype.BASE:
        assert_primitive(place, detail[0], annotation, metadata)
    else:
        assert_array(place, description, annotation, metadata)


def assert_primitive(place: str, primitive: str, annotation: Any, metadata: list[Any]) -> None:
    if primitive in LIMITS:
        assert annotation is int, place
        lower, upper = bounds(metadata)
        assert LIMITS[primitive][0] <= lower <= upper <= LIMITS[primitive][1], place
    else:
        expected = {"float32": float, "float64": float, "bool": bool, "string": str}[primitive]
        assert annotation is expected, place


def assert_array(place: str, description: Any, annotation: Any, metadata: list[Any]) -> None:
    node, (inner, count) = description
    longest = [item.max_length for item in metadata if isinstance(item, annotated_types.MaxLen)]
    shortest = [item.min_length for item in metadata if isinstance(item, annotated_types.MinLen)]
    assert longest == ([count] if count else []), place
    assert shortest == ([count] if node == Nodetype.ARRAY else []), place
    if get_origin(annotation) is tuple:
        element, rest = get_args(annotation)
        assert rest is Ellipsis, place
        assert_type(place, inner, element, [])
    else:
        dtype = get_args(get_args(annotation)[1])[0]
        assert np.dtype(dtype) == np.dtype(NUMPY_CODES[inner[1][0]]), place


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


@all_models
def test_a_models_constants_are_those_of_its_file(kind: type[Message]) -> None:
    in_file = integers(kind.ros_type)
    in_model = {name: value for name, value in vars(kind).items() if name.isupper()}
    assert in_model.items() <= in_file.items()
    if kind.ros_type in SHIPPED:
        assert in_model == in_file


def test_hashes_are_those_of_ros_2() -> None:
    """Two standard types against the hashes that ROS 2 Jazzy publishes; and one hash a type."""
    assert type_hash(messages.String) == "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    hashes = {type_hash(kind) for kind in MODELS.values()}
    assert len(hashes) == len(MODELS)
    assert all(value.startswith("RIHS01_") and len(value) == 71 for value in hashes)


# --- the codec ---


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
            lower, upper = bounds(metadata)
            return st.integers(int(lower), int(upper))
        return numbers(detail[0])
    inner, count = detail
    shortest, longest = (count, count) if node == Nodetype.ARRAY else (0, count or 2)
    return st.lists(values(inner, []), min_size=shortest, max_size=longest)


def models(kind: type[Message]) -> st.SearchStrategy[Message]:
    """Any message of a type."""
    metadata = {name: field.metadata for name, field in kind.model_fields.items()}
    fitting = {name: values(description, metadata[name]) for name, description in fields(kind.ros_type)}
    return st.fixed_dictionaries(fitting).map(lambda given_fields: kind(**given_fields))


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


def quick(examples: int) -> Callable[[Any], Any]:
    """Few examples of each of many types."""
    checks = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]
    return settings(max_examples=examples, deadline=None, derandomize=True, suppress_health_check=checks)


@all_models
@quick(8)
@given(data=st.data())
def test_a_message_is_encoded_as_rosbags_encodes_its_own(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(models(kind))
    payload = encode(message)
    own = native((Nodetype.NAME, kind.ros_type), message)
    assert payload == bytes(typestore().serialize_cdr(own, kind.ros_type))
    assert decode(kind, payload) == message


@all_models
@quick(8)
@given(data=st.data())
def test_a_truncated_message_is_refused(kind: type[Message], data: st.DataObject) -> None:
    payload = encode(data.draw(models(kind)))
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(PayloadError):
        decode(kind, payload[:cut])


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


# --- the fast path ---


def has_flat_numbers(kind: type[Message]) -> bool:
    """Whether a type has numbers and no arrays of messages, and so can have a fixed layout."""
    try:
        return any(primitive != "string" for _, primitive, _ in flat_fields(kind.ros_type))
    except TypeError:
        return False


FLAT = {name: kind for name, kind in MODELS.items() if has_flat_numbers(kind)}


@pytest.mark.parametrize("kind", list(FLAT.values()), ids=list(FLAT))
@quick(8)
@given(data=st.data())
def test_a_fixed_layout_packs_what_encode_encodes(kind: type[Message], data: st.DataObject) -> None:
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
        FixedLayout(messages.Imu, {"frame": "map"})
    with pytest.raises(PayloadError, match="other frame"):
        FixedLayout(messages.Imu, {"header.frame_id": "abc"}).unpack(
            encode(messages.Imu(header=messages.Header(frame_id="xyz")))
        )
