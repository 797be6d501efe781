"""Names of coordinate frames, as in REP-105: the map, the robot's body and what is fixed to it."""

from typing import Final

MAP_FRAME: Final = "map"
BODY_FRAME: Final = "base_link"
IMU_FRAME: Final = "imu_link"
GNSS_FRAME: Final = "gnss_link"
TOOL_FRAME: Final = "tool_link"
"""Nozzle, or middle of the drum, on the ground."""
TRUE_BODY_FRAME: Final = "base_link_truth"
"""The body where it really is, which only an emulator knows."""
