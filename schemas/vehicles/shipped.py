"""The vehicles that come with Touchline, by name."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from touchline.schemas.scenario import SurfaceName
from touchline.schemas.vehicles.rear_steered_drive import RearSteeredDrive
from touchline.schemas.vehicles.roller_tool import RollerTool
from touchline.schemas.vehicles.vehicle import Vehicle
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class ShippedVehicle(NamedTuple):
    """One of them.

    Attributes:
        vehicle: Itself.
        surface: What it drives on where a scenario does not say.
        summary: One line for people.
    """

    vehicle: Vehicle
    surface: SurfaceName
    summary: str


CLAY_ROLLER: Final = Vehicle(
    name="clay-roller",
    body=VehicleBody(
        mass_empty_kg=2500.0,
        radius_of_gyration_m=1.1,
        footprint_m=(
            (0.4, -1.1),
            (0.4, 1.1),
            (-0.4, 1.1),
            (-0.4, 0.6),
            (-2.5, 0.6),
            (-2.5, -0.6),
            (-0.4, -0.6),
            (-0.4, -1.1),
        ),
        gnss_antenna_z_m=0.9,
        battery_wh=12_000.0,
        idle_power_w=250.0,
    ),
    drive=RearSteeredDrive(),
    tool=RollerTool(),
)
"""A roller for salt pans, after a published study; what that does not say is assumed (docs/vehicles.md)."""

SHIPPED: Final[Mapping[str, ShippedVehicle]] = MappingProxyType(
    {
        "turf-tank-two": ShippedVehicle(Vehicle(), "grass", "paints lines on grass"),
        "clay-roller": ShippedVehicle(CLAY_ROLLER, "clay", "rolls clay, steered by its rear wheel"),
    }
)
