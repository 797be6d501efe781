"""The vehicles that come with Touchline, by name."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario, SurfaceName
from touchline.schemas.vehicles.rear_steered_drive import RearSteeredDrive
from touchline.schemas.vehicles.roller_tool import RollerTool
from touchline.schemas.vehicles.vehicle import Vehicle
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class ShippedVehicle(NamedTuple):
    """One of them.

    Attributes:
        vehicle: Itself.
        surface: What it drives on where a scenario does not say.
        follower: What steers it where nobody says.
        summary: One line for people.
    """

    vehicle: Vehicle
    surface: SurfaceName
    follower: str
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
        "turf-tank-two": ShippedVehicle(Vehicle(), "grass", "mpc", "paints lines on grass"),
        "clay-roller": ShippedVehicle(CLAY_ROLLER, "clay", "pure-pursuit", "rolls clay, steered by its rear wheel"),
    }
)


def on_its_ground(name: str, scenario: Scenario) -> Scenario:
    """The scenario; where it does not say what the ground is, with that which the shipped vehicle of a name is for."""
    shipped = SHIPPED.get(name)
    if shipped is None or "surface" in scenario.ground.model_fields_set:
        return scenario
    ground = scenario.ground.model_copy(update={"surface": shipped.surface})
    return scenario.model_copy(update={"ground": ground})


def with_its_follower(name: str, config: OnboardConfig) -> OnboardConfig:
    """The configuration; where it does not say what steers, with what suits the shipped vehicle of a name."""
    shipped = SHIPPED.get(name)
    if shipped is None or "follower" in config.model_fields_set:
        return config
    return config.model_copy(update={"follower": shipped.follower})
