"""Effects of faults on the world and the sensors in a tick, for the kernels of both.

`Effects.sized(n)()` is a robot of n actuators without faults. Faults that overlap add up where they can (offsets,
biases); otherwise the worst one counts.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record
from touchline.onboard.interface import ACTUATORS

MOST_SENSORS: Final = 16
"""Largest number of rows of `SENSORS`: more than are shipped, so that one more needs no recompilation of kernels."""
FREE: Final = -1.0
"""Position of a plunger that is not stuck."""
FIXED: Final = 3.0
"""Value of the best fix."""

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class MessageEffects(Record):
    """Effects on messages in transit, by the numbers of `SENSORS`."""

    late_ticks: Annotated[Floats, MOST_SENSORS]
    spread_ticks: Annotated[Floats, MOST_SENSORS]
    lost_share: Annotated[Floats, MOST_SENSORS]
    again_share: Annotated[Floats, MOST_SENSORS]
    """Share of them that arrives twice, the second time after:"""
    again_ticks: Annotated[Floats, MOST_SENSORS]


class Effects(Record):
    """Effects of all acting faults; unless noted otherwise arrays have a place per actuator, in the drive's order."""

    bumper: bool
    """True if the bumper is pressed."""
    operator_lost: bool
    battery_share: float = 1.0
    """Largest usable share of the full charge."""
    tank_max_l: float = math.inf
    """Largest usable amount of paint."""
    blocked: Annotated[Integers, ACTUATORS]
    """1 for a blocked actuator, else 0."""
    slip: Annotated[Floats, ACTUATORS]
    """Share of ground speed lost."""
    torque_share: Annotated[Floats, ACTUATORS] = np.ones(1)
    """Share of its torque that each actuator has."""
    offset_rad: Annotated[Floats, ACTUATORS]
    """Angle of each actuator beyond its encoder's reading."""
    valve: float = FREE
    """FREE, or the position at which the plunger is stuck: 0 closed … 1 open."""
    disc: float = FREE
    """The same for the discs, 0 up … 1 down."""
    flow_share: float = 1.0
    """Share of the paint that gets through."""

    fix_cap: float = FIXED
    """Best fix that is possible."""
    claimed_m: float
    """1 σ reported by the receiver whatever the true one; 0: the usual."""
    corrections_lost: bool
    gnss_offset_m: Annotated[Floats, 2]
    """East, north."""
    gnss_white_m: float
    """Additional white noise, 1 σ."""
    gnss_hidden_m: float
    """Part of it that the receiver does not report."""
    clock_offset_s: float
    """Offset of the receiver's clock at sim time 0."""
    clock_drift: float
    """Drift of the receiver's clock, s/s."""

    camera_out: bool
    """True if the overhead camera does not find the robot."""
    camera_east_m: float
    """Offset of the robot that it takes for this one, and the angle by which that is turned against it."""
    camera_north_m: float
    camera_rad: float

    gyro_bias_radps: float
    """Bias about z."""
    accel_bias_mps2: float
    """Bias along x."""
    gyro_white_radps: float
    """White noise per sample, 1 σ; the next is that of the accelerometer."""
    accel_white_mps2: float
    imu_stuck: bool
    field_east_t: float
    field_north_t: float
    encoder_out: Annotated[Integers, ACTUATORS]
    """1 for an encoder that counts nothing, else 0."""
    lidar_blind: bool
    """True if no beam of a lidar has a return."""
    lidar_false_share: float
    """Share of the beams with a false return, in addition to the scenario's."""
    messages: MessageEffects

    def reset(self, **values: Any) -> None:
        """Set these values, and all other fields to their defaults."""
        super().reset(**values)
        #: Effects of faults of other packages, by names of their own; no kernel reads them.
        self.others: dict[str, float] = {}
