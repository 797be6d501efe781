"""Body twist to wheel speeds within the wheels' limits."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.onboard.interface import TICK_S
from touchline.services.onboard.trajectory.path_projection import LEFT_RADIUS, RIGHT_RADIUS, SPEED, YAW_RATE

MAX_LEAD_TICKS = 14

W_HALF_TRACK: Final = 0  # m
W_MAX_RATE: Final = 1  # rad/s
W_REACH: Final = 2  # rad/s by which a command may differ from the wheel's speed
W_SIDE_SLIP: Final = 3  # rad per m/s² across
W_ACROSS: Final = 4  # m/s², planned at most across the path
W_BRAKE: Final = 5  # m/s² along it
PARAMETERS: Final = 6

Floats = NDArray[np.float64]


def lead_ticks(vehicle: Vehicle) -> int:
    """How many ticks ahead of time a steadily changing speed must be commanded to come true: the motors' lag.

    The mean of that tick, not its start, is what its command stands for: that makes up for the command being held.
    """
    return min(round(float(vehicle.drive.motor_time_constant_s) / TICK_S), MAX_LEAD_TICKS)


def wheel_limits(vehicle: Vehicle) -> NDArray[np.float64]:
    """(PARAMETERS,) differential drive, limits, nominal side slip and planned accelerations of this vehicle."""
    p = np.zeros(PARAMETERS)
    p[W_HALF_TRACK] = vehicle.drive.half_track_m
    p[W_MAX_RATE] = vehicle.drive.max_wheel_speed_radps
    # A first-order motor accelerates by (command − speed) / lag.
    p[W_REACH] = vehicle.drive.max_wheel_acceleration_radps2 * max(vehicle.drive.motor_time_constant_s, TICK_S)
    p[W_SIDE_SLIP] = vehicle.drive.side_slip_rad_per_mps2
    p[W_ACROSS], p[W_BRAKE] = vehicle.drive.max_lateral_acceleration_mps2, vehicle.drive.max_acceleration_mps2
    return p


@kernel
def command_wheels(speed_mps: float, yaw_rate_radps: float, now: Floats, p: Floats, wheels: Floats) -> None:
    """Wheel speeds for a wanted twist, given the actual one and effective radii of `now` (NOW,) of `path_projection`.

    Too fast is scaled down with the curvature kept; too sudden for the wheels is cut off. `p` is (PARAMETERS,),
    `wheels` (2,) is filled [rad/s].
    """
    half, fastest = p[W_HALF_TRACK], p[W_MAX_RATE]
    left = (speed_mps - half * yaw_rate_radps) / now[LEFT_RADIUS]
    right = (speed_mps + half * yaw_rate_radps) / now[RIGHT_RADIUS]
    faster = max(abs(left), abs(right))
    if faster > fastest:
        left, right = left * fastest / faster, right * fastest / faster
    left_now = (now[SPEED] - half * now[YAW_RATE]) / now[LEFT_RADIUS]
    right_now = (now[SPEED] + half * now[YAW_RATE]) / now[RIGHT_RADIUS]
    left = min(max(left, left_now - p[W_REACH]), left_now + p[W_REACH])
    right = min(max(right, right_now - p[W_REACH]), right_now + p[W_REACH])
    wheels[0], wheels[1] = min(max(left, -fastest), fastest), min(max(right, -fastest), fastest)
