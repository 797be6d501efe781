"""Converts recorded messages of replaced types into their present types."""

from collections.abc import Callable
from typing import Any

from touchline.schemas.cdr import encode, full_definition
from touchline.schemas.messages import ActuatorCommand
from touchline.schemas.messages.base import Message
from touchline.services.bridge.decoding import decoder
from touchline.services.bridge.recorded import Damage, Recorded, RecordingKind


def presented(message: Recorded) -> Recorded:
    """Convert to the present type; a message that needs no conversion, or cannot be decoded, is returned as it is."""
    replaced = _REPLACED.get(message.kind.type)
    read = decoder(message.kind) if replaced is not None else None
    if replaced is None or read is None:
        return message
    try:
        present = replaced(read(message.payload))
    except Damage:
        return message
    schema = full_definition(type(present))
    kind = RecordingKind("cdr", present.ros_type, "ros2msg", schema)
    return message._replace(payload=encode(present), kind=kind)


def _actuator_command(wheels: Any) -> ActuatorCommand:
    """Of what there was when all vehicles had two wheels."""
    values = [wheels.left_radps, wheels.right_radps]
    return ActuatorCommand(header=wheels.header, names=("left", "right"), values=values)


_REPLACED: dict[str, Callable[[Any], Message]] = {"touchline_msgs/msg/WheelCommand": _actuator_command}
"""By the name of the type that was replaced."""
