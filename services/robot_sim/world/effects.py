"""What faults do to the world and the sensors in a tick, for the kernels of both.

`Effects.sized(n)()` is a robot of n actuators without faults. Faults that overlap add up where they can (offsets,
biases), and else the worst one counts.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record
from touchline.onboard.interface import ACTUATORS

MOST_SENSORS: Final = 16
"""Most rows of `SENSORS`: more than are shipped, so that one more needs no kernel compiled anew."""
FREE: Final = -1.0
"""Of a plunger that is not stuck."""
FIXED: Final = 3.0
"""The best fix."""

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class MessageEffects(Record):
    """Of messages under way, by the numbers of `SENSORS`."""

    late_ticks: Annotated[Floats, MOST_SENSORS]
    spread_ticks: Annotated[Floats, MOST_SENSORS]
    lost_share: Annotated[Floats, MOST_SENSORS]
    again_share: Annotated[Floats, MOST_SENSORS]
    """Of them arrives twice, the second time after:"""
    again_ticks: Annotated[Floats, MOST_SENSORS]


class Effects(Record):
    """All of them; an array has one place for each actuator, in the drive's order, if not said otherwise."""

    bumper: bool
    """Pressed."""
    operator_lost: bool
    battery_share: float = 1.0
    """Of the full charge, usable at most."""
    tank_max_l: float = math.inf
    """Usable at most."""
    blocked: Annotated[Integers, ACTUATORS]
    """1: it is, 0: it is not."""
    slip: Annotated[Floats, ACTUATORS]
    """Share of ground speed lost."""
    torque_share: Annotated[Floats, ACTUATORS] = np.ones(1)
    """That is left."""
    offset_rad: Annotated[Floats, ACTUATORS]
    """By which an actuator is beyond its encoder's angle."""
    valve: float = FREE
    """FREE, or where its plunger is stuck: 0 closed … 1 open."""
    disc: float = FREE
    """The same of the discs, 0 up … 1 down."""
    flow_share: float = 1.0
    """Of the paint, that gets through."""

    fix_cap: float = FIXED
    """The best fix that can be had."""
    claimed_m: float
    """1 σ reported by the receiver whatever is true; 0: the usual."""
    corrections_lost: bool
    gnss_offset_m: Annotated[Floats, 2]
    """East, north."""
    gnss_white_m: float
    """Additional, 1 σ."""
    gnss_hidden_m: float
    """The part of it that the receiver does not admit."""
    clock_offset_s: float
    """Of the receiver's clock at sim time 0."""
    clock_drift: float
    """Of the same, s/s."""

    camera_out: bool
    """The camera overhead does not find the robot."""

    gyro_bias_radps: float
    """About z."""
    accel_bias_mps2: float
    """Along x."""
    gyro_white_radps: float
    """Per sample, 1 σ, as of the accelerometer:"""
    accel_white_mps2: float
    imu_stuck: bool
    field_east_t: float
    field_north_t: float
    encoder_out: Annotated[Integers, ACTUATORS]
    """As `blocked`."""
    messages: MessageEffects

    def reset(self, **values: Any) -> None:
        """Set these values, and all other fields to their defaults."""
        super().reset(**values)
        #: What faults of other packages do, by names of their own; no kernel sees it.
        self.others: dict[str, float] = {}
