"""What faults do to the world and the sensors in a tick, as one vector that the kernels read.

`neutral()` is a robot without faults. Faults that overlap add up where they can (offsets, biases), and else the worst
one counts.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.onboard.interface import ACTUATORS

# Body and actuators.
BUMPER: Final = 0
OPERATOR_LOST: Final = 1
BATTERY_MAX: Final = 2  # usable share of the charge
TANK_MAX_L: Final = 3
BLOCKED: Final = 4  # this and the next ones of each actuator, in the drive's order
SLIP: Final = BLOCKED + ACTUATORS  # share of ground speed lost
TORQUE: Final = SLIP + ACTUATORS  # share of torque left
VALVE: Final = TORQUE + ACTUATORS  # FREE, or the plunger's position
DISC: Final = VALVE + 1
FLOW: Final = VALVE + 2  # share of the paint that gets through
# GNSS.
FIX_CAP: Final = VALVE + 3  # best fix that can be had
CLAIMED_M: Final = VALVE + 4  # 1σ reported whatever is true; 0: the usual
CORRECTIONS_LOST: Final = VALVE + 5
OFFSET_EAST_M: Final = VALVE + 6
OFFSET_NORTH_M: Final = VALVE + 7
GNSS_WHITE_M: Final = VALVE + 8  # additional, 1σ
GNSS_HIDDEN_M: Final = VALVE + 9  # the part of it that the receiver does not admit
CLOCK_OFFSET_S: Final = VALVE + 10  # at sim time 0
CLOCK_DRIFT: Final = VALVE + 11  # s/s
# Inertial, magnetic, encoders.
GYRO_BIAS: Final = VALVE + 12  # about z
ACCEL_BIAS: Final = VALVE + 13  # along x
GYRO_WHITE: Final = VALVE + 14  # per sample, 1σ
ACCEL_WHITE: Final = VALVE + 15
IMU_STUCK: Final = VALVE + 16
FIELD_EAST_T: Final = VALVE + 17
FIELD_NORTH_T: Final = VALVE + 18
ENCODER_OUT: Final = VALVE + 19  # of each actuator
# Messages: MESSAGES + PER_SENSOR * sensor + what.
MESSAGES: Final = ENCODER_OUT + ACTUATORS
LATE_TICKS: Final = 0
SPREAD_TICKS: Final = 1
LOST_SHARE: Final = 2
AGAIN_SHARE: Final = 3
AGAIN_TICKS: Final = 4
PER_SENSOR: Final = 5
SENSORS: Final = ("gnss", "imu", "magnetometer", "encoder")
OFFSET: Final = MESSAGES + PER_SENSOR * len(SENSORS)  # of each actuator, rad: it is so much beyond its encoder's angle
SIZE: Final = OFFSET + ACTUATORS

FREE: Final = -1.0
FIXED: Final = 3.0


def neutral() -> NDArray[np.float64]:
    """(SIZE,) no fault."""
    effects = np.zeros(SIZE)
    effects[[BATTERY_MAX, FLOW]] = 1.0
    effects[TORQUE : TORQUE + ACTUATORS] = 1.0
    effects[TANK_MAX_L] = math.inf
    effects[[VALVE, DISC]] = FREE
    effects[FIX_CAP] = FIXED
    return effects
