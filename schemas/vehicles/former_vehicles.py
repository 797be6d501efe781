"""Converts vehicles of the former flat format, found in users' files and recordings, into body, drive and tool."""

from typing import Any

from touchline.schemas.misfit import misfit
from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.differential_drive import DifferentialDrive
from touchline.schemas.vehicles.sprayer_tool import SprayerTool
from touchline.schemas.vehicles.vehicle_body import VehicleBody

PARTS: dict[str, type[Spec]] = {"body": VehicleBody, "drive": DifferentialDrive, "tool": SprayerTool}
LATER = frozenset(("kind", "max_yaw_rate_radps"))
"""Fields that never were at the top."""
FORMER_FIELDS = {"kinematics": ("drive", "kind")} | {
    name: (part, name) for part, spec in PARTS.items() for name in spec.model_fields if name not in LATER
}
"""Part and field by the name that a field had at the top: all were those of a differential drive with a sprayer."""


def in_parts(given: Any) -> Any:
    """Convert a vehicle of the former format to the present one.

    Raises:
        ValidationError: It has parts and fields that belong into them.
    """
    if not isinstance(given, dict):
        return given
    former = [name for name in given if name in FORMER_FIELDS]
    if not former:
        return given
    if any(part in given for part in PARTS):
        place = ".".join(FORMER_FIELDS[former[0]])
        raise misfit(former[0], given[former[0]], f"give it as {place}, where body, drive and tool are apart")
    moved: dict[str, Any] = {name: value for name, value in given.items() if name not in FORMER_FIELDS}
    for name in former:
        part, field = FORMER_FIELDS[name]
        moved.setdefault(part, {})[field] = given[name]
    return moved
