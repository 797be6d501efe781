"""The onboard side of a drive: twist to actuators, and encoder readings to odometry.

Kernels take the figures of a drive, a named tuple; the class of that tuple has the kernels below, so that code is
compiled for the drive at hand (`touchline.core.jit.kernel_of_class`). Actuators and their encoders are in the
order of `DriveSpec.actuators`, and arrays of them have its length. `now` is that of `tracking_state`.
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
    """An error of odometry that hardly changes: a Gauss-Markov process of this σ and time constant."""

    sigma: float
    tau_s: float


class Aim(NamedTuple):
    """How far ahead pursuit aims, by the speed and at least, and how fast it takes out what is left beside the path.

    The nimbler a drive the nearer: its yaw rate has to follow within the time to that place.
    """

    lookahead_s: float = 0.30
    lookahead_min_m: float = 0.22
    lateral_integral_1pm2s: float = 1.2


class OnboardDrive(ABC):
    """The onboard side of a drive, outside of kernels.

    Attributes:
        figures: For kernels.
        lag_s: Time constant with which the actuators follow their commands.
        limit: (actuators,) largest absolute commands.
        reach: (actuators,) by how much a command may differ from what its actuator does.
        lag_share: (actuators,) by which share of the difference an actuator gets nearer to its command in a tick.
        max_step: (actuators,) by how much it changes in a tick at most.
        tolerance: (actuators,) by how much it may differ from what is expected of it, or by `tolerance_share` of that.
        tolerance_share: See `tolerance`.
        disobeyed: For people, what is wrong if an actuator does not follow its command.
        side_slip_rad_per_mps2: Sideways slip angle per lateral acceleration.
        lasting_errors: Of its two errors of odometry; None: it is a slip, which comes and goes.
        move_scale: By how much a command may change in a second at the cost of a small error: of
            each, or one number of all; see `mpc`.
        horizon_ticks: Steps of the MPC's horizon: fine where the next command acts, coarse where only the course
            matters, and in all as long as it takes to steer back to the path and along it.
        aim: Of pursuit.
    """

    figures: Any
    lag_s: float
    limit: Floats
    reach: Floats
    lag_share: Floats
    max_step: Floats
    tolerance: Floats
    tolerance_share: Floats
    disobeyed: tuple[str, ...]
    side_slip_rad_per_mps2: float
    lasting_errors: tuple[LastingError | None, LastingError | None] = (None, None)
    move_scale: float | tuple[float, ...] = 8.0
    horizon_ticks: tuple[int, ...] = (1, 2, 3, 4, 5, 5, 6, 8, 10, 12, 14, 16)
    aim: Aim = Aim()

    def resting(self, actuators: tuple[float, ...]) -> tuple[float, ...]:
        """The commands of a robot that is to stand, after these: its wheels at rest."""
        return (0.0,) * len(actuators)

    @abstractmethod
    def __init__(self, vehicle: Vehicle, track_width_relative: float) -> None:
        """The drive of a vehicle whose track, or whatever tells its yaw rate, is uncertain by a share (1 σ)."""

    @abstractmethod
    def moves_mps(self, actuators: Floats) -> float:
        """How fast anything that touches the ground moves by these commands (actuators,)."""

    @abstractmethod
    def check_curvature(self, name: str, curvature_1pm: float) -> None:
        """Check that a segment of this curvature can be driven.

        Raises:
            CommandRefused: It cannot; `name` says which segment it is.
        """

    @abstractmethod
    def check_speeds(self, speed_mps: Floats, curvature_1pm: Floats, name: Callable[[int], str]) -> None:
        """Check that segments (n,) of these curvatures can be driven so fast.

        Raises:
            CommandRefused: One cannot; `name` says which, by its index.
        """

    @abstractmethod
    def check_spin(self, name: str, rate_radps: float) -> None:
        """Check that the vehicle can turn on the spot so fast.

        Raises:
            CommandRefused: It cannot; `name` says which segment it is.
        """

    @abstractmethod
    def spin_acceleration_radps2(self) -> float:
        """The yaw acceleration with which the vehicle turns on the spot."""


def drive_of(vehicle: Vehicle, track_width_relative: float = 0.0) -> OnboardDrive:
    """The onboard side of a vehicle's drive.

    Raises:
        SpecError: The robot's computer knows no such drive.
    """
    drive: OnboardDrive = part_for(DRIVES, vehicle.drive.kind, "onboard")(vehicle, track_width_relative)
    return drive


@kernel_of_class
def read(figures: Any, span: int, buffer: SampleBuffer, row: TickInputs) -> bool:
    """Convert the increments of the encoders since their last sample to odometry.

    Args:
        figures: Of the drive.
        span: Ticks since then.
        buffer: With the newest angles, and what has been `turned_rad`; `measured` is filled in: what each actuator
            does, in the unit of its command.
        row: Of the tick; both numbers of `odometry` are filled in.

    Returns:
        Whether nothing moves.
    """
    raise NotImplementedError


@kernel_of_class
def smooth(figures: Any, before: TickInputs, z: TickInputs) -> None:
    """Fill in the smoothed speeds that the errors of odometry are a share of: both numbers of `smooth`.

    Args:
        figures: Of the drive.
        before: Of the tick before.
        z: Of this tick.
    """
    raise NotImplementedError


@kernel_of_class
def strain(figures: Any, P: Floats, before: TickInputs, z: TickInputs) -> None:
    """Add the process noise of the errors of odometry that depends on what the drive does.

    Args:
        figures: Of the drive.
        P: (STATES, STATES) predicted covariance, updated.
        before: Of the tick before.
        z: Of this tick.
    """
    raise NotImplementedError


@kernel_of_class
def odometry(figures: Any, x: Floats, z: TickInputs, h: Floats) -> tuple[float, float, float]:
    """Innovations and Jacobian of a tick's odometry.

    Args:
        figures: Of the drive.
        x: (STATES,) predicted.
        z: Of the tick.
        h: (2, STATES) zeros; the Jacobian of the measurements is filled in.

    Returns:
        Both innovations [m/s], and the variance of each [m²/s²].
    """
    raise NotImplementedError


@kernel_of_class
def effective(figures: Any, x: Floats, now: Floats) -> None:
    """Fill in the factors that convert actuators and twist into each other: the two numbers from EFFECT on.

    Args:
        figures: Of the drive.
        x: (STATES,) the estimate.
        now: (NOW,) of `tracking_state`.
    """
    raise NotImplementedError


@kernel_of_class
def twist(figures: Any, actuators: Floats, now: Floats) -> tuple[float, float]:
    """The twist of the body while the actuators do what is given.

    Args:
        figures: Of the drive.
        actuators: (actuators,) in their units.
        now: (NOW,) with the factors of `effective`.

    Returns:
        Speed [m/s] and yaw rate [rad/s] of the body.
    """
    raise NotImplementedError


@kernel_of_class
def actuators_of(figures: Any, speed_mps: float, yaw_rate_radps: float, now: Floats) -> tuple[float, ...]:
    """The commands for a twist, whatever the actuators' limits: the inverse of `twist`.

    Args:
        figures: Of the drive.
        speed_mps: Of the body.
        yaw_rate_radps: Of the body.
        now: (NOW,) with the factors of `effective`.

    Returns:
        For each actuator, in its unit.
    """
    raise NotImplementedError


@kernel_of_class
def gain(figures: Any, actuator: int, now: Floats) -> tuple[float, float]:
    """What a unit of one actuator adds to the twist: the derivative of `twist`.

    Args:
        figures: Of the drive.
        actuator: Its number.
        now: (NOW,) with the factors of `effective`.

    Returns:
        Of speed [m/s] and of yaw rate [rad/s], per unit.
    """
    raise NotImplementedError


@kernel_of_class
def command(figures: Any, speed_mps: float, yaw_rate_radps: float, now: Floats, actuators: Floats) -> None:
    """The commands for a wanted twist, within the actuators' limits and within reach of what they do.

    Args:
        figures: Of the drive.
        speed_mps: Of the body, wanted.
        yaw_rate_radps: Of the body, wanted.
        now: (NOW,) with the present twist and the factors of `effective`.
        actuators: (actuators,) filled in.
    """
    raise NotImplementedError
