"""The shipped ``.msg``/``.srv`` files and the pydantic models say the same thing."""

from typing import Any, get_args, get_origin

import annotated_types
import numpy as np
from rosbags.interfaces import Nodetype

from tests.schemas.any_message import LIMITS, MODELS, bounds, fields
from touchline.schemas import messages
from touchline.schemas.cdr import NUMPY_CODES, definition_files, type_hash, typestore

SHIPPED = {name for name, _ in definition_files()}

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


def test_every_file_has_a_model_and_every_model_of_ours_a_file() -> None:
    ours = {name for name in MODELS if name.startswith(("tt_", "touchline_msgs/"))}
    assert ours == SHIPPED
    assert len(MODELS) > len(SHIPPED) >= 40


def test_the_robots_own_tree_is_exact() -> None:
    tree = {name: ", ".join(f"{field} {written(kind)}" for field, kind in fields(name)) for name in TURF_TANK}
    assert tree == TURF_TANK
    constants = {name: integers(name) for name in TURF_TANK}
    assert {name: values for name, values in constants.items() if values} == TURF_TANK_CONSTANTS


def test_models_have_the_fields_of_their_files_in_order_and_with_their_types() -> None:
    for kind in MODELS.values():
        assert list(kind.model_fields) == [name for name, _ in fields(kind.ros_type)], kind.ros_type
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


def test_models_have_the_constants_of_their_files() -> None:
    for kind in MODELS.values():
        in_file = integers(kind.ros_type)
        in_model = {name: value for name, value in vars(kind).items() if name.isupper()}
        assert in_model.items() <= in_file.items(), kind.ros_type
        assert kind.ros_type not in SHIPPED or in_model == in_file, kind.ros_type


def test_hashes_are_those_of_ros_2() -> None:
    """Two standard types against the hashes that ROS 2 Jazzy publishes; and one hash a type."""
    assert type_hash(messages.String) == "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    hashes = {type_hash(kind) for kind in MODELS.values()}
    assert len(hashes) == len(MODELS)
    assert all(value.startswith("RIHS01_") and len(value) == 71 for value in hashes)
