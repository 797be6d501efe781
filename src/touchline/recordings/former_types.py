"""Converts recorded messages of replaced types into their present types."""

from collections.abc import Callable
from typing import Any

from touchline.recordings.channels import kind_of
from touchline.recordings.decoding import decoder
from touchline.recordings.recorded import Damage, Recorded, RecordingKind
from touchline.schemas.cdr import encode
from touchline.schemas.messages import ActuatorCommand
from touchline.schemas.messages.base import Message


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
    return message._replace(payload=encode(present), kind=kind_of(type(present)))


def present_kind(kind: RecordingKind) -> RecordingKind:
    """Return the kind that `presented` gives for messages of this kind."""
    present = _PRESENT.get(kind.type)
    return kind if present is None else kind_of(present)


def _actuator_command(wheels: Any) -> ActuatorCommand:
    """Convert from the time when all vehicles had two wheels."""
    values = [wheels.left_radps, wheels.right_radps]
    return ActuatorCommand(header=wheels.header, names=("left", "right"), values=values)


_REPLACED: dict[str, Callable[[Any], Message]] = {"touchline_msgs/msg/WheelCommand": _actuator_command}
"""Converters by the name of the replaced type."""
_PRESENT: dict[str, type[Message]] = {"touchline_msgs/msg/WheelCommand": ActuatorCommand}
"""Present type of each replaced type."""
