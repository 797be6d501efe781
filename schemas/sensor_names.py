"""Names in `SENSORS`: of the sensors that are part of the robot, then of auxiliary ones that it knows more of."""

from typing import Final

GNSS: Final = "gnss"
IMU: Final = "imu"
MAGNETOMETER: Final = "magnetometer"
ENCODER: Final = "encoder"
CAMERA: Final = "camera"

LIDAR: Final = "lidar"
RANGER: Final = "ranger"
BUMPER_STRIP: Final = "bumper-strip"
