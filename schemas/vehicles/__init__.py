"""Vehicles as data: a body with a drive and a tool."""

from touchline.schemas.vehicles.actuator import Actuator
from touchline.schemas.vehicles.differential_drive import DifferentialDrive, Motor
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.sprayer_tool import SprayerTool
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle import Vehicle
from touchline.schemas.vehicles.vehicle_body import VehicleBody

__all__ = ["Actuator", "DifferentialDrive", "DriveSpec", "Motor", "SprayerTool", "ToolSpec", "Vehicle", "VehicleBody"]
