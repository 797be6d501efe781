"""Names in `SENSORS` of the sensors that are part of the robot, and not auxiliary ones."""

from typing import Final

GNSS: Final = "gnss"
IMU: Final = "imu"
MAGNETOMETER: Final = "magnetometer"
ENCODER: Final = "encoder"
CAMERA: Final = "camera"
