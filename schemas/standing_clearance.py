"""Standing clearance: distance from known outlines at which the protection of a robot lets it follow a plan."""

from typing import Final

from touchline.schemas.vehicles import LidarSpec, Vehicle

HIT_ERROR_M: Final = 0.1
"""Allowance for the error of a lidar's hits."""
OFF_PATH_M: Final = 0.05
"""Allowance for the robot's distance from its path, and for the way between two poses that protection looks at."""


def standing_clearance_m(vehicle: Vehicle) -> float:
    """Return the distance (m) that plans of lines keep from obstacles, which stand; 0 without a lidar."""
    if not any(isinstance(each, LidarSpec) for each in vehicle.sensors):
        return 0.0
    return vehicle.protection.margin_m + HIT_ERROR_M + OFF_PATH_M
