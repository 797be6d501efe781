"""Parameters of a ROS 2 node (package rcl_interfaces), as its six parameter services tell and take them."""

from enum import IntEnum
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from touchline.schemas.messages.base import (
    BoolArray,
    Float64Array,
    Int64,
    Int64Array,
    Message,
    UInt8,
    UInt8Array,
    UInt64,
)

_NO_BYTES = np.zeros(0, np.uint8)
_NO_BOOLS = np.zeros(0, np.bool_)
_NO_INTEGERS = np.zeros(0, np.int64)
_NO_DOUBLES = np.zeros(0)


class ParameterValue(Message):
    """A value: its type, and the one field that holds it."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/ParameterValue"
    type: UInt8 = 0
    bool_value: bool = False
    integer_value: Int64 = 0
    double_value: float = 0.0
    string_value: str = ""
    byte_array_value: UInt8Array = _NO_BYTES
    bool_array_value: BoolArray = _NO_BOOLS
    integer_array_value: Int64Array = _NO_INTEGERS
    double_array_value: Float64Array = _NO_DOUBLES
    string_array_value: tuple[str, ...] = ()


class ParameterKind(IntEnum):
    """The numbers of the types, as in ``rcl_interfaces/msg/ParameterType``."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9


class RosParameter(Message):
    """A parameter, or a wish to set it."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/Parameter"
    name: str = ""
    value: ParameterValue = ParameterValue()


class FloatingPointRange(Message):
    """Range of a double."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/FloatingPointRange"
    from_value: float = 0.0
    to_value: float = 0.0
    step: float = 0.0


class IntegerRange(Message):
    """Range of an integer."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/IntegerRange"
    from_value: Int64 = 0
    to_value: Int64 = 0
    step: UInt64 = 0


class ParameterDescriptor(Message):
    """Description of a parameter."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/ParameterDescriptor"
    name: str = ""
    type: UInt8 = 0
    description: str = ""
    additional_constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    floating_point_range: Annotated[tuple[FloatingPointRange, ...], Field(max_length=1)] = ()
    integer_range: Annotated[tuple[IntegerRange, ...], Field(max_length=1)] = ()


class SetParametersResult(Message):
    """Success if a parameter was set, or the reason why not."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/SetParametersResult"
    successful: bool = False
    reason: str = ""


class ListParametersResult(Message):
    """Names, and what they begin with."""

    ros_type: ClassVar[str] = "rcl_interfaces/msg/ListParametersResult"
    names: tuple[str, ...] = ()
    prefixes: tuple[str, ...] = ()


class ListParametersRequest(Message):
    """Asks which parameters there are below any of the prefixes, no deeper than ``depth`` (0: at any depth)."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/ListParameters_Request"
    DEPTH_RECURSIVE: ClassVar[int] = 0
    prefixes: tuple[str, ...] = ()
    depth: UInt64 = 0


class ListParametersResponse(Message):
    """Names of the parameters that there are."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/ListParameters_Response"
    result: ListParametersResult = ListParametersResult()


class GetParametersRequest(Message):
    """Asks for the values of parameters."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/GetParameters_Request"
    names: tuple[str, ...] = ()


class GetParametersResponse(Message):
    """The values in the order of the names."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/GetParameters_Response"
    values: tuple[ParameterValue, ...] = ()


class GetParameterTypesRequest(Message):
    """Asks for the types of parameters."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/GetParameterTypes_Request"
    names: tuple[str, ...] = ()


class GetParameterTypesResponse(Message):
    """The types in the order of the names."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/GetParameterTypes_Response"
    types: UInt8Array = _NO_BYTES


class DescribeParametersRequest(Message):
    """Asks what parameters are."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/DescribeParameters_Request"
    names: tuple[str, ...] = ()


class DescribeParametersResponse(Message):
    """The descriptions in the order of the names."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/DescribeParameters_Response"
    descriptors: tuple[ParameterDescriptor, ...] = ()


class SetParametersRequest(Message):
    """Set them, each on its own."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/SetParameters_Request"
    parameters: tuple[RosParameter, ...] = ()


class SetParametersResponse(Message):
    """Result of each parameter."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/SetParameters_Response"
    results: tuple[SetParametersResult, ...] = ()


class SetParametersAtomicallyRequest(Message):
    """Set all of them, or none."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/SetParametersAtomically_Request"
    parameters: tuple[RosParameter, ...] = ()


class SetParametersAtomicallyResponse(Message):
    """Result of all parameters."""

    ros_type: ClassVar[str] = "rcl_interfaces/srv/SetParametersAtomically_Response"
    result: SetParametersResult = SetParametersResult()
