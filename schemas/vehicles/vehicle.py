"""Vehicles: a robot as data. The defaults are the Turf Tank Two."""

from typing import Any, Self

from pydantic import (
    Field,
    SerializeAsAny,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)

from touchline.schemas.plugins import DRIVES, TOOLS, Registry
from touchline.schemas.spec import GrownSpec
from touchline.schemas.vehicles.differential_drive import DifferentialDrive
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.former_vehicles import in_parts
from touchline.schemas.vehicles.misfit import misfit
from touchline.schemas.vehicles.positioning import GNSS, Positioning
from touchline.schemas.vehicles.sprayer_tool import SprayerTool
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class Vehicle(GrownSpec):
    """A body with a drive and a tool, each of one of the kinds that are registered."""

    name: str = "turf-tank-two"
    """Name for people, and in reports."""
    body: VehicleBody = VehicleBody()
    positioning: Positioning = GNSS
    """Source of the robot's position; recorded only if it is not GNSS."""
    drive: SerializeAsAny[DriveSpec] = DifferentialDrive()
    tool: SerializeAsAny[ToolSpec] = Field(default=SprayerTool(), validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _in_parts(cls, given: Any) -> Any:
        return in_parts(given)

    later_fields = ("positioning",)

    @field_validator("drive", mode="wrap")
    @classmethod
    def _drive_of_its_kind(cls, given: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        return _of_its_kind(DRIVES, given, info) if isinstance(given, dict) else handler(given)

    @field_validator("tool", mode="wrap")
    @classmethod
    def _tool_of_its_kind(cls, given: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        tool = _of_its_kind(TOOLS, given, info) if isinstance(given, dict) else handler(given)
        if "body" in info.data and "drive" in info.data:
            tool.check(info.data["body"], info.data["drive"])
        return tool

    @property
    def mass_full_kg(self) -> float:
        """With all that the tool can carry."""
        return self.tool.full_kg(self.body)

    def changed(
        self,
        *,
        body: dict[str, Any] | None = None,
        drive: dict[str, Any] | None = None,
        tool: dict[str, Any] | None = None,
    ) -> Self:
        """The same vehicle with other figures in these parts, unchecked as with `model_copy`."""
        updates = {"body": body, "drive": drive, "tool": tool}
        parts = {name: getattr(self, name).model_copy(update=update) for name, update in updates.items() if update}
        return self.model_copy(update=parts)


def _of_its_kind(registry: Registry[Any], given: dict[str, Any], info: ValidationInfo) -> Any:
    """The drive or tool, as the kind that it names has it; the first one registered if it names none."""
    kind = given.get("kind", registry.default)
    if kind not in registry.names():
        raise misfit("kind", kind, registry.advice)
    return registry.find(kind).part("spec").model_validate(given, context=info.context)
