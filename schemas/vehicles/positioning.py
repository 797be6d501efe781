"""Sources of a robot's position."""

from typing import Final, Literal

Positioning = Literal["gnss", "overhead-camera", "odometry"]
"""A receiver on board, a camera that sees the robot from above, or nothing but its own motion from a known start."""

GNSS: Final[Positioning] = "gnss"
OVERHEAD_CAMERA: Final[Positioning] = "overhead-camera"
ODOMETRY: Final[Positioning] = "odometry"
