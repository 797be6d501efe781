"""What faults do to the world and the sensors in a tick, as one vector that the kernels read.

`neutral()` is a robot without faults. Faults that overlap add up where they can (offsets, biases), and else the worst
one counts.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

# Body and actuators.
BUMPER: Final = 0
OPERATOR_LOST: Final = 1
BATTERY_MAX: Final = 2  # usable share of the charge
TANK_MAX_L: Final = 3
BLOCKED: Final = 4  # this and the next ones of each actuator, in the drive's order
SLIP: Final = 6  # share of ground speed lost
TORQUE: Final = 8  # share of torque left
VALVE: Final = 10  # FREE, or the plunger's position
DISC: Final = 11
FLOW: Final = 12  # share of the paint that gets through
# GNSS.
FIX_CAP: Final = 13  # best fix that can be had
CLAIMED_M: Final = 14  # 1σ reported whatever is true; 0: the usual
CORRECTIONS_LOST: Final = 15
OFFSET_EAST_M: Final = 16
OFFSET_NORTH_M: Final = 17
GNSS_WHITE_M: Final = 18  # additional, 1σ
GNSS_HIDDEN_M: Final = 19  # the part of it that the receiver does not admit
CLOCK_OFFSET_S: Final = 20  # at sim time 0
CLOCK_DRIFT: Final = 21  # s/s
# Inertial, magnetic, encoders.
GYRO_BIAS: Final = 22  # about z
ACCEL_BIAS: Final = 23  # along x
GYRO_WHITE: Final = 24  # per sample, 1σ
ACCEL_WHITE: Final = 25
IMU_STUCK: Final = 26
FIELD_EAST_T: Final = 27
FIELD_NORTH_T: Final = 28
ENCODER_OUT: Final = 29  # of each actuator
# Messages: MESSAGES + PER_SENSOR * sensor + what.
MESSAGES: Final = 31
LATE_TICKS: Final = 0
SPREAD_TICKS: Final = 1
LOST_SHARE: Final = 2
AGAIN_SHARE: Final = 3
AGAIN_TICKS: Final = 4
PER_SENSOR: Final = 5
SENSORS: Final = ("gnss", "imu", "magnetometer", "encoder")
SIZE: Final = MESSAGES + PER_SENSOR * len(SENSORS)

FREE: Final = -1.0
FIXED: Final = 3.0


def neutral() -> NDArray[np.float64]:
    """(SIZE,) no fault."""
    effects = np.zeros(SIZE)
    effects[[BATTERY_MAX, FLOW, TORQUE, TORQUE + 1]] = 1.0
    effects[TANK_MAX_L] = math.inf
    effects[[VALVE, DISC]] = FREE
    effects[FIX_CAP] = FIXED
    return effects
