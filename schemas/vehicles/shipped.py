"""The vehicles that come with Touchline, by name."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from touchline.schemas.onboard import DriveSheet, OnboardConfig
from touchline.schemas.scenario import Scenario, SurfaceName
from touchline.schemas.vehicles.differential_drive import DifferentialDrive, Motor
from touchline.schemas.vehicles.no_tool import NoTool
from touchline.schemas.vehicles.positioning import OVERHEAD_CAMERA
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
        drive: What its computer is told of its wheels on that ground where nobody says.
    """

    vehicle: Vehicle
    surface: SurfaceName
    follower: str
    summary: str
    drive: DriveSheet = DriveSheet()


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
"""A roller for salt pans, after a published study; what that does not say is assumed (docs/reference/vehicles.md)."""

TURTLEBOT3_WAFFLE_PI: Final = Vehicle(
    name="turtlebot3-waffle-pi",
    positioning=OVERHEAD_CAMERA,
    body=VehicleBody(
        mass_empty_kg=1.8,
        radius_of_gyration_m=0.11,
        footprint_m=((0.0765, -0.153), (0.0765, 0.153), (-0.2045, 0.153), (-0.2045, -0.153)),
        gnss_antenna_x_m=-0.064,
        gnss_antenna_z_m=0.141,
        battery_wh=20.0,
        idle_power_w=6.0,
    ),
    drive=DifferentialDrive(
        transit_speed_mps=0.26,
        max_acceleration_mps2=0.5,
        max_lateral_acceleration_mps2=0.5,
        default_kappa_max_1pm=3.0,
        default_sigma_max_1pm2=15.0,
        wheel_radius_m=0.033,
        track_width_m=0.287,
        max_wheel_speed_radps=7.8788,
        max_wheel_acceleration_radps2=40.0,
        max_yaw_rate_radps=1.82,
        planned_wheel_acceleration_radps2=20.0,
        motor=Motor(
            gear_ratio=200.0,
            constant_nm_per_a=0.007,
            resistance_ohm=5.0,
            max_current_a=2.3,
            inertia_kgm2=0.002,
            friction_nm=0.05,
            viscous_nms=0.005,
        ),
        encoder_ticks_per_revolution=4096,
        wheel_width_m=0.018,
        caster_x_m=-0.177,
        caster_trail_m=0.005,
        casters_m=((-0.177, 0.064), (-0.177, -0.064)),
        caster_width_m=0.01,
        caster_radius_m=0.02,
    ),
    tool=NoTool(line_speed_mps=0.26),
)
"""A small robot for teaching, of a study on trajectory tracking; what its maker does not say is assumed."""

TURTLEBOT2: Final = Vehicle(
    name="turtlebot2",
    positioning=OVERHEAD_CAMERA,
    body=VehicleBody(
        mass_empty_kg=6.0,
        radius_of_gyration_m=0.12,
        footprint_m=tuple(
            (0.177 * math.cos(corner * math.pi / 8.0), 0.177 * math.sin(corner * math.pi / 8.0)) for corner in range(16)
        ),
        gnss_antenna_z_m=0.42,
        battery_wh=32.0,
        idle_power_w=12.0,
    ),
    drive=DifferentialDrive(
        transit_speed_mps=0.5,
        max_acceleration_mps2=0.5,
        max_lateral_acceleration_mps2=0.5,
        default_kappa_max_1pm=10.0 / 3.0,
        default_sigma_max_1pm2=15.0,
        wheel_radius_m=0.035,
        track_width_m=0.23,
        max_wheel_speed_radps=20.0,
        max_wheel_acceleration_radps2=60.0,
        max_yaw_rate_radps=3.14,
        planned_wheel_acceleration_radps2=30.0,
        motor=Motor(
            gear_ratio=50.0,
            constant_nm_per_a=0.011,
            resistance_ohm=1.55,
            max_current_a=6.0,
            inertia_kgm2=0.002,
            friction_nm=0.05,
            viscous_nms=0.005,
        ),
        encoder_ticks_per_revolution=2578,
        wheel_width_m=0.02,
        caster_x_m=0.0,
        caster_trail_m=0.005,
        casters_m=((0.12, 0.0), (-0.12, 0.0)),
        caster_width_m=0.02,
        caster_radius_m=0.02,
    ),
    tool=NoTool(line_speed_mps=0.5),
)
"""A round robot on a Kobuki base, of a study on a network of robots; what its maker does not say is assumed."""

ON_GRASS: Final = DriveSheet(side_slip_m_rtm=0.004)
"""Data sheet of a marker's wheels on mown grass: they slide aside less than those of an unknown robot may (assumed)."""

ON_A_FLOOR: Final = DriveSheet(slip_relative=0.004)
"""Data sheet of wheels on a floor: they slip a fifth of what they do on grass, as the emulated floor has it."""

SHIPPED: Final[Mapping[str, ShippedVehicle]] = MappingProxyType(
    {
        "turf-tank-two": ShippedVehicle(Vehicle(), "grass", "mpc", "paints lines on grass", ON_GRASS),
        "clay-roller": ShippedVehicle(CLAY_ROLLER, "clay", "pure-pursuit", "rolls clay, steered by its rear wheel"),
        "turtlebot3-waffle-pi": ShippedVehicle(
            TURTLEBOT3_WAFFLE_PI, "floor", "mpc", "a small robot without a tool, 0.26 m/s", ON_A_FLOOR
        ),
        "turtlebot2": ShippedVehicle(
            TURTLEBOT2, "floor", "mpc", "a round robot without a tool, for fleets", ON_A_FLOOR
        ),
    }
)

DEFAULT_NAME: Final = next(iter(SHIPPED))
"""Name of the vehicle that is taken where nobody says which."""


def on_its_ground(name: str, scenario: Scenario) -> Scenario:
    """The scenario; where it does not say what the ground is, with that which the shipped vehicle of a name is for."""
    shipped = SHIPPED.get(name)
    if shipped is None or "surface" in scenario.ground.model_fields_set:
        return scenario
    ground = scenario.ground.model_copy(update={"surface": shipped.surface})
    return scenario.model_copy(update={"ground": ground})


def with_its_own(name: str, config: OnboardConfig) -> OnboardConfig:
    """The configuration; where it says nothing of follower and drive, with what suits the shipped vehicle of a name."""
    shipped = SHIPPED.get(name)
    if shipped is None:
        return config
    own = {"follower": shipped.follower, "drive": shipped.drive}
    return config.model_copy(update={part: own[part] for part in own if part not in config.model_fields_set})
