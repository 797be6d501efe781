"""A robot's setup as ROS 2 parameters: names with dots, and values of ROS 2's types; all of them read-only."""

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from touchline.schemas import messages as m
from touchline.schemas.messages import ParameterKind
from touchline.schemas.setup import Setup
from touchline.schemas.spec import EVERY_FIELD

_DOT: Final = "."
_LARGEST: Final = 2**63 - 1
READ_ONLY: Final = "is read-only: it is what the robot was started with (docs/ros2.md says where it is set)"


def parameters_of(setup: Setup | None) -> dict[str, m.ParameterValue]:
    """Every parameter by its name; of a robot that has not told its setup yet only what each node has."""
    told = setup.model_dump(mode="json", context=EVERY_FIELD) if setup is not None else {}
    return dict(sorted(_flat({"use_sim_time": True, **told})))


def listed(names: Mapping[str, object], request: m.ListParametersRequest) -> m.ListParametersResult:
    """The names that are asked for, chosen as rclpy's nodes do, and what they begin with."""
    found = [name for name in names if _asked_for(name, request)]
    prefixes = dict.fromkeys(name.rpartition(_DOT)[0] for name in found if _DOT in name)
    return m.ListParametersResult(names=tuple(found), prefixes=tuple(prefixes))


def described(name: str, value: m.ParameterValue) -> m.ParameterDescriptor:
    """What is said of a parameter."""
    return m.ParameterDescriptor(name=name, type=value.type, additional_constraints=READ_ONLY, read_only=True)


def refusal(names: Mapping[str, object], wish: m.RosParameter) -> m.SetParametersResult:
    """Why a parameter is not set."""
    reason = READ_ONLY if wish.name in names else "is no parameter of this robot"
    return m.SetParametersResult(reason=f"{wish.name!r} {reason}")


def _asked_for(name: str, request: m.ListParametersRequest) -> bool:
    below = [name] if not request.prefixes else []
    for prefix in request.prefixes:
        if name == prefix:
            return True
        if name.startswith(prefix + _DOT):
            below.append(name.removeprefix(prefix + _DOT))
    any_depth = request.depth == request.DEPTH_RECURSIVE
    return any(any_depth or rest.count(_DOT) < request.depth for rest in below)


def _flat(told: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, m.ParameterValue]]:
    for name, value in told.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}{_DOT}")
        elif value is not None:
            yield f"{prefix}{name}", _value(value)


def _value(value: Any) -> m.ParameterValue:
    """What JSON says, in the narrowest type of ROS 2 that holds it; as JSON text where none does."""
    if isinstance(value, bool):
        return m.ParameterValue(type=ParameterKind.BOOL, bool_value=value)
    if isinstance(value, int) and abs(value) <= _LARGEST:
        return m.ParameterValue(type=ParameterKind.INTEGER, integer_value=value)
    if isinstance(value, float):
        return m.ParameterValue(type=ParameterKind.DOUBLE, double_value=value)
    if isinstance(value, str):
        return m.ParameterValue(type=ParameterKind.STRING, string_value=value)
    if isinstance(value, list) and value and all(isinstance(each, float) for each in value):
        return m.ParameterValue(type=ParameterKind.DOUBLE_ARRAY, double_array_value=value)
    if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        return m.ParameterValue(type=ParameterKind.STRING_ARRAY, string_array_value=tuple(value))
    return m.ParameterValue(type=ParameterKind.STRING, string_value=json.dumps(value))
