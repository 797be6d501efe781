"""Vehicles as data: a body with a drive and a tool."""

from touchline.schemas.vehicles.actuator import Actuator
from touchline.schemas.vehicles.differential_drive import DifferentialDrive, Motor
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.ground_contact import GroundContact
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.schemas.vehicles.no_tool import NoTool
from touchline.schemas.vehicles.positioning import GNSS, ODOMETRY, OVERHEAD_CAMERA, Positioning
from touchline.schemas.vehicles.protection import Protection
from touchline.schemas.vehicles.rear_steered_drive import DrumMotor, RearSteeredDrive
from touchline.schemas.vehicles.roller_tool import RollerTool
from touchline.schemas.vehicles.sensor_spec import SensorSpec
from touchline.schemas.vehicles.sprayer_tool import SprayerTool
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle import Vehicle
from touchline.schemas.vehicles.vehicle_body import VehicleBody

__all__ = [
    "GNSS",
    "ODOMETRY",
    "OVERHEAD_CAMERA",
    "Actuator",
    "DifferentialDrive",
    "DriveSpec",
    "DrumMotor",
    "GroundContact",
    "LidarSpec",
    "Motor",
    "NoTool",
    "Positioning",
    "Protection",
    "RearSteeredDrive",
    "RollerTool",
    "SensorSpec",
    "SprayerTool",
    "ToolSpec",
    "Vehicle",
    "VehicleBody",
]
