"""Robot's setup as ROS 2 parameters: names with dots, and values of ROS 2's types; all of them read-only."""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from pydantic import ValidationError

from touchline.schemas import messages as m
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages import ParameterKind
from touchline.schemas.setup import Setup
from touchline.schemas.spec import EVERY_FIELD
from touchline.schemas.topics import SETUP

_DOT: Final = "."
_LARGEST: Final = 2**63 - 1
READ_ONLY: Final = "is read-only: it was set when the robot was started (see docs/guides/ros2.md)"


class RobotParameters:
    """Parameters of a robot from its published setup, which is decoded at the first request.

    Args:
        reject: Called with the reason if the setup is invalid.
    """

    def __init__(self, reject: Callable[[str], None]) -> None:
        self._reject = reject
        self._setup: bytes | None = None
        self._known = parameters_of(None)

    def take_setup(self, payload: bytes) -> None:
        """Keep the robot's setup."""
        self._setup = payload

    def known(self) -> dict[str, m.ParameterValue]:
        """Return all parameters by name."""
        payload, self._setup = self._setup, None
        if payload is not None:
            try:
                setup = Setup.model_validate_json(decode(m.String, payload).data)
            except (PayloadError, TouchlineError, ValidationError, RecursionError) as error:
                self._reject(f"{SETUP.name}: {error}")
            else:
                self._known = parameters_of(setup)
        return self._known


def parameters_of(setup: Setup | None) -> dict[str, m.ParameterValue]:
    """Return every parameter by its name; without a setup only those that each node has."""
    fields = setup.model_dump(mode="json", context=EVERY_FIELD) if setup is not None else {}
    return dict(sorted(_flat({"use_sim_time": True, **fields})))


def listed(names: Mapping[str, object], request: m.ListParametersRequest) -> m.ListParametersResult:
    """Return the requested names, chosen as rclpy's nodes do, and their prefixes."""
    found = [name for name in names if _asked_for(name, request)]
    prefixes = dict.fromkeys(name.rpartition(_DOT)[0] for name in found if _DOT in name)
    return m.ListParametersResult(names=tuple(found), prefixes=tuple(prefixes))


def described(name: str, value: m.ParameterValue) -> m.ParameterDescriptor:
    """Return the descriptor of a parameter."""
    return m.ParameterDescriptor(name=name, type=value.type, additional_constraints=READ_ONLY, read_only=True)


def refusal(names: Mapping[str, object], parameter: m.RosParameter) -> m.SetParametersResult:
    """Return why a parameter is not set."""
    reason = READ_ONLY if parameter.name in names else "is no parameter of this robot"
    return m.SetParametersResult(reason=f"{parameter.name!r} {reason}")


def plain_value(value: m.ParameterValue) -> Any:
    """Return a parameter's value as a Python object."""
    match value.type:
        case ParameterKind.BOOL:
            return value.bool_value
        case ParameterKind.INTEGER:
            return value.integer_value
        case ParameterKind.DOUBLE:
            return value.double_value
        case ParameterKind.DOUBLE_ARRAY:
            return [float(each) for each in value.double_array_value]
        case ParameterKind.STRING_ARRAY:
            return list(value.string_array_value)
    return value.string_value


def _asked_for(name: str, request: m.ListParametersRequest) -> bool:
    below = [name] if not request.prefixes else []
    for prefix in request.prefixes:
        if name == prefix:
            return True
        if name.startswith(prefix + _DOT):
            below.append(name.removeprefix(prefix + _DOT))
    any_depth = request.depth == request.DEPTH_RECURSIVE
    return any(any_depth or rest.count(_DOT) < request.depth for rest in below)


def _flat(fields: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, m.ParameterValue]]:
    for name, value in fields.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}{_DOT}")
        elif value is not None:
            yield f"{prefix}{name}", _value(value)


def _value(value: Any) -> m.ParameterValue:
    """Convert a JSON value to the narrowest type of ROS 2 that holds it; to JSON text where none does."""
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
