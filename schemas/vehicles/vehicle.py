"""Vehicles: a robot as data. The defaults are the Turf Tank Two."""

from typing import Annotated, Any, Self

from pydantic import (
    Field,
    SerializeAsAny,
    ValidationInfo,
    WrapValidator,
    field_validator,
    model_validator,
)

from touchline.schemas.kinds import of_its_kind
from touchline.schemas.misfit import misfit
from touchline.schemas.plugins import DRIVES, SENSORS, TOOLS
from touchline.schemas.spec import GrownSpec
from touchline.schemas.vehicles.differential_drive import DifferentialDrive
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.former_vehicles import in_parts
from touchline.schemas.vehicles.positioning import GNSS, Positioning
from touchline.schemas.vehicles.protection import Protection
from touchline.schemas.vehicles.sensor_spec import SensorSpec
from touchline.schemas.vehicles.sprayer_tool import SprayerTool
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody

Drive = Annotated[SerializeAsAny[DriveSpec], WrapValidator(of_its_kind(DRIVES, usual="differential"))]
Tool = Annotated[SerializeAsAny[ToolSpec], WrapValidator(of_its_kind(TOOLS, usual="sprayer"))]
Sensor = Annotated[SerializeAsAny[SensorSpec], WrapValidator(of_its_kind(SENSORS))]


class Vehicle(GrownSpec):
    """A body with a drive and a tool, each of one of the kinds that are registered."""

    name: str = "turf-tank-two"
    """Name for people, and in reports."""
    body: VehicleBody = VehicleBody()
    positioning: Positioning = GNSS
    """Source of the robot's position; recorded only if it is not GNSS."""
    drive: Drive = DifferentialDrive()
    tool: Tool = Field(default=SprayerTool(), validate_default=True)
    sensors: Annotated[tuple[Sensor, ...], Field(max_length=20)] = ()
    """Auxiliary sensors, recorded only if there are any."""
    protection: Protection = Protection()
    """Protection against contact, of a vehicle with a lidar; recorded only if it is not the default."""

    @model_validator(mode="before")
    @classmethod
    def _in_parts(cls, given: Any) -> Any:
        return in_parts(given)

    later_fields = ("positioning", "sensors", "protection")

    @field_validator("tool")
    @classmethod
    def _tool_suits(cls, tool: ToolSpec, info: ValidationInfo) -> ToolSpec:
        if "body" in info.data and "drive" in info.data:
            tool.check(info.data["body"], info.data["drive"])
        return tool

    @field_validator("sensors")
    @classmethod
    def _sensors_have_names_of_their_own(cls, sensors: tuple[SensorSpec, ...]) -> tuple[SensorSpec, ...]:
        names = [each.name for each in sensors]
        for name in names:
            if names.count(name) > 1:
                raise misfit("name", name, "give each sensor a name of its own")
        return sensors

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
