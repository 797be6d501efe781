"""Onboard side of a drive: twist to actuators, and encoder readings to odometry.

Kernels take the figures of a drive, a named tuple whose class has the kernels below, so that code is compiled for the
drive at hand (`touchline.core.jit.kernel_of_class`). Actuators and their encoders are in the order of
`DriveSpec.actuators`, and arrays of them have its length. `now` is laid out as in `tracking_state`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel_of_class
from touchline.onboard.computer_state import SampleBuffer
from touchline.onboard.filter_model import TickInputs
from touchline.schemas.plugins import DRIVES, part_for
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]


class LastingError(NamedTuple):
    """Parameters of a slowly varying error of odometry: a Gauss-Markov process with this σ and time constant."""

    sigma: float
    tau_s: float


class Aim(NamedTuple):
    """Lookahead of pursuit, by the speed and at least, and the gain with which it removes a lasting lateral error.

    The more agile a drive, the shorter: its yaw rate has to follow within the time to the target point.
    """

    lookahead_s: float = 0.30
    lookahead_min_m: float = 0.22
    lateral_integral_1pm2s: float = 1.2


class OnboardDrive(ABC):
    """Onboard side of a drive, outside of kernels.

    Attributes:
        figures: Parameters for kernels.
        lag_s: Time constant with which the actuators follow their commands.
        driven_share: Share of the weight on what drives and brakes the vehicle.
        limit: (actuators,) largest absolute commands.
        reach: (actuators,) largest difference between a command and the actuator's present value.
        lag_share: (actuators,) share of the difference to its command by which an actuator approaches it in a tick.
        max_step: (actuators,) largest change in a tick.
        tolerance: (actuators,) allowed deviation from the expected value, or `tolerance_share` of that value.
        tolerance_share: See `tolerance`.
        disobeyed: For people: what is wrong if an actuator does not follow its command.
        side_slip_rad_per_mps2: Side slip angle per lateral acceleration.
        lasting_errors: Models of the two errors of odometry; None: the error is a slip, which comes and goes.
        slip_hides_arm: True if slip in bends looks like an antenna farther to one side, as the robot cannot turn on
            the spot: fixes do not teach where it is to the left.
        move_scale: Change of a command in a second that costs as much as a small error: of each, or one number for all;
            see `mpc`.
        one_way: (actuators,) True for one whose direction is the robot's: on a leg forward it never turns backward, as
            the MPC would have it do to correct the heading.
        horizon_ticks: Steps of the MPC's horizon: fine where the next command acts, coarse where only the course
            matters, and in all as long as it takes to steer back to the path and along it.
        aim: Parameters of pursuit.
    """

    figures: Any
    lag_s: float
    driven_share: float = 1.0
    limit: Floats
    reach: Floats
    lag_share: Floats
    max_step: Floats
    tolerance: Floats
    tolerance_share: Floats
    disobeyed: tuple[str, ...]
    side_slip_rad_per_mps2: float
    lasting_errors: tuple[LastingError | None, LastingError | None] = (None, None)
    slip_hides_arm: bool = False
    move_scale: float | tuple[float, ...] = 8.0
    one_way: bool | tuple[bool, ...] = False
    horizon_ticks: tuple[int, ...] = (1, 2, 3, 4, 5, 5, 6, 8, 10, 12, 14, 16)
    aim: Aim = Aim()

    def resting(self, actuators: tuple[float, ...]) -> tuple[float, ...]:
        """Return the commands of a robot that is to stand, after these commands: its wheels at rest."""
        return (0.0,) * len(actuators)

    @abstractmethod
    def __init__(self, vehicle: Vehicle, track_width_relative: float) -> None:
        """Take the parameters of a vehicle's drive.

        Args:
            vehicle: With this kind of drive.
            track_width_relative: Relative uncertainty of the track, or of whatever determines the yaw rate (1 σ).
        """

    @abstractmethod
    def moves_mps(self, actuators: Floats) -> float:
        """Return the speed [m/s] of the fastest part that touches the ground under these commands (actuators,)."""

    @abstractmethod
    def check_curvature(self, name: str, curvature_1pm: float) -> None:
        """Check that a segment can be driven.

        Args:
            name: Name of the segment in the refusal.
            curvature_1pm: Curvature of the segment.

        Raises:
            CommandRefused: It cannot be driven.
        """

    @abstractmethod
    def check_speeds(self, speed_mps: Floats, curvature_1pm: Floats, name: Callable[[int], str]) -> None:
        """Check that segments can be driven at their speeds.

        Args:
            speed_mps: (n,) largest speed on each segment.
            curvature_1pm: (n,) curvature of each.
            name: Name of a segment in the refusal, by its index.

        Raises:
            CommandRefused: A segment cannot.
        """

    @abstractmethod
    def check_spin(self, name: str, rate_radps: float) -> None:
        """Check that the vehicle can turn on the spot at a rate.

        Args:
            name: Name of the segment in the refusal.
            rate_radps: Largest yaw rate of the turn.

        Raises:
            CommandRefused: It cannot.
        """

    @abstractmethod
    def spin_acceleration_radps2(self) -> float:
        """Return the yaw acceleration with which the vehicle turns on the spot."""


def drive_of(vehicle: Vehicle, track_width_relative: float = 0.0) -> OnboardDrive:
    """Make the onboard side of a vehicle's drive.

    Args:
        vehicle: Vehicle with a registered kind of drive.
        track_width_relative: Relative uncertainty of the track, or of whatever determines the yaw rate (1 σ).

    Raises:
        SpecError: The robot's computer knows no such drive.
    """
    drive: OnboardDrive = part_for(DRIVES, vehicle.drive.kind, "onboard")(vehicle, track_width_relative)
    return drive


@kernel_of_class
def read(figures: Any, span: int, buffer: SampleBuffer, row: TickInputs) -> bool:
    """Convert the increments of the encoders since their last sample to odometry.

    Args:
        figures: Parameters of the drive.
        span: Ticks since that sample.
        buffer: Newest angles and the increments `turned_rad`; `measured` is filled in: the value of each actuator, in
            the unit of its command.
        row: Inputs of the tick; both numbers of `odometry` are filled in.

    Returns:
        True if nothing moves.
    """
    raise NotImplementedError


@kernel_of_class
def smooth(figures: Any, before: TickInputs, z: TickInputs) -> None:
    """Fill in the smoothed values that the errors of odometry are a share of: both numbers of `smooth`.

    Args:
        figures: Parameters of the drive.
        before: Inputs of the tick before.
        z: Inputs of this tick.
    """
    raise NotImplementedError


@kernel_of_class
def strain(figures: Any, P: Floats, before: TickInputs, z: TickInputs) -> None:
    """Add the process noise of the errors of odometry that depends on the motion of the drive.

    Args:
        figures: Parameters of the drive.
        P: (STATES, STATES) predicted covariance, updated.
        before: Inputs of the tick before.
        z: Inputs of this tick.
    """
    raise NotImplementedError


@kernel_of_class
def odometry(figures: Any, x: Floats, z: TickInputs, h: Floats) -> tuple[float, float, float]:
    """Compute the innovations and the Jacobian of a tick's odometry.

    Args:
        figures: Parameters of the drive.
        x: (STATES,) predicted state.
        z: Inputs of the tick.
        h: (2, STATES) zeros; the Jacobian of the measurements is filled in.

    Returns:
        Both innovations [m/s], and the variance of each [m²/s²].
    """
    raise NotImplementedError


@kernel_of_class
def effective(figures: Any, x: Floats, now: Floats) -> None:
    """Fill in the factors that convert between actuators and twist: the two numbers from EFFECT on.

    Args:
        figures: Parameters of the drive.
        x: (STATES,) estimate.
        now: (NOW,) layout of `tracking_state`.
    """
    raise NotImplementedError


@kernel_of_class
def twist(figures: Any, actuators: Floats, now: Floats) -> tuple[float, float]:
    """Compute the twist of the body from the values of the actuators.

    Args:
        figures: Parameters of the drive.
        actuators: (actuators,) in their units.
        now: (NOW,) with the factors of `effective`.

    Returns:
        Speed [m/s] and yaw rate [rad/s] of the body.
    """
    raise NotImplementedError


@kernel_of_class
def actuators_of(figures: Any, speed_mps: float, yaw_rate_radps: float, now: Floats) -> tuple[float, ...]:
    """Compute the commands for a twist, ignoring the actuators' limits: the inverse of `twist`.

    Args:
        figures: Parameters of the drive.
        speed_mps: Speed of the body.
        yaw_rate_radps: Yaw rate of the body.
        now: (NOW,) with the factors of `effective`.

    Returns:
        Command of each actuator, in its unit.
    """
    raise NotImplementedError


@kernel_of_class
def gain(figures: Any, actuator: int, now: Floats) -> tuple[float, float]:
    """Compute the derivative of `twist` with respect to one actuator.

    Args:
        figures: Parameters of the drive.
        actuator: Index of the actuator.
        now: (NOW,) with the factors of `effective`.

    Returns:
        Change of speed [m/s] and of yaw rate [rad/s] per unit of the actuator.
    """
    raise NotImplementedError


@kernel_of_class
def command(figures: Any, speed_mps: float, yaw_rate_radps: float, now: Floats, actuators: Floats) -> None:
    """Compute the commands for a wanted twist, within the actuators' limits and within reach of their present values.

    Args:
        figures: Parameters of the drive.
        speed_mps: Wanted speed of the body.
        yaw_rate_radps: Wanted yaw rate of the body.
        now: (NOW,) with the present twist and the factors of `effective`.
        actuators: (actuators,) filled in.
    """
    raise NotImplementedError
