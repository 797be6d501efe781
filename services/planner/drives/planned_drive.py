"""Planning model of a drive: the interface of all kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, NamedTuple

from touchline.core.jit import kernel_of_class
from touchline.schemas.plugins import DRIVES, part_for

if TYPE_CHECKING:
    from touchline.schemas.vehicles import Vehicle
    from touchline.services.planner.geometry.clothoid import Floats


class ActuatorMotion(NamedTuple):
    """Motion of k actuators along a path.

    Attributes:
        value: (k, …) value of each of the drive's `actuators`: a wheel's rate (rad/s), a steering angle (rad).
        rate: (k, …) change of the value per second.
    """

    value: Floats
    rate: Floats


class PlannedDrive(ABC):
    """Drive of a vehicle, as plans see it. Speeds are of the body frame's origin.

    Attributes:
        caps: Named tuple for compiled code, whose class has the kernels `square_cap`, `gain` and `spin_lever_m` (see
            below).
        max_speed_mps: Maximum speed straight ahead.
        acceleration_mps2: Maximum acceleration straight ahead.
        curvature_max_1pm: Maximum curvature of paths.
        tightest_1pm: Maximum curvature of turns by default.
    """

    caps: Any
    max_speed_mps: float
    acceleration_mps2: float
    curvature_max_1pm: float
    tightest_1pm: float

    @abstractmethod
    def curvature_at(self, speed_mps: float) -> float:
        """Maximum curvature (1/m) at a speed."""

    @abstractmethod
    def sharpness_at(self, speed_mps: float) -> float:
        """Sharpness (1/m²) of turns at a constant speed, with acceleration to spare for braking and speeding up."""

    @abstractmethod
    def turns_within(self, lateral_mps2: float) -> bool:
        """True if the drive by itself keeps every turn within a lateral acceleration."""

    @abstractmethod
    def least_s(self, length_m: float, turned_rad: float) -> float:
        """Lower bound (s) on the time of any path of this length and total turn (rad)."""

    @abstractmethod
    def actuation(
        self,
        direction: Floats,
        square: Floats,
        acceleration_mps2: Floats,
        curvature_1pm: Floats,
        sharpness_1pm2: Floats,
    ) -> ActuatorMotion:
        """Motion of the actuators along a path; all arguments have the same shape.

        Args:
            direction: 1 forward, -1 backward.
            square: v² (m²/s²).
            acceleration_mps2: Change of the speed v, whatever its sign.
            curvature_1pm: Curvature dθ/ds of the path, where s falls when it is driven backward.
            sharpness_1pm2: Change of curvature per metre driven.
        """

    @abstractmethod
    def spinning(self, rate_radps: float) -> Floats:
        """Actuator values (k, 1) for a rate of turning on the spot; for an angular acceleration, their rates."""

    @abstractmethod
    def power_w(self, speed_mps: Floats, yaw_rate_radps: Floats, mass_kg: Floats, step_s: float) -> Floats:
        """Power (W) (n,) drawn at speeds, yaw rates and masses (n,) that are sampled every `step_s`."""


def planned_drive(vehicle: Vehicle) -> PlannedDrive:
    """Create the planning model of a vehicle's drive, by the drive's kind.

    Raises:
        SpecError: The kind cannot be planned for.
    """
    found: PlannedDrive = part_for(DRIVES, vehicle.drive.kind, "planner")(vehicle)
    return found


@kernel_of_class
def square_cap(caps: Any, curvature: float, sharpness: float) -> float:  # type: ignore[empty-body]
    """Maximum u = v² (m²/s²) that the drive can keep throughout a stretch.

    Args:
        caps: `PlannedDrive.caps`; the kernel of its class is called.
        curvature: Maximum |curvature| of the stretch (1/m).
        sharpness: Its |sharpness| (1/m²).
    """


@kernel_of_class
def gain(  # type: ignore[empty-body]
    caps: Any, square: float, curvature: float, sharpness: float, length: float
) -> float:
    """Maximum acceleration (m/s²) that the drive can keep throughout a stretch; may be negative.

    Args:
        caps: `PlannedDrive.caps`; the kernel of its class is called.
        square: u = v² (m²/s²) at the beginning of the stretch.
        curvature: Signed curvature at its beginning (1/m).
        sharpness: Signed sharpness, constant (1/m²).
        length: Length of the stretch (m).
    """


@kernel_of_class
def spin_lever_m(caps: Any) -> float:  # type: ignore[empty-body]
    """Distance (m) from the origin at which a turn on the spot has the speed and acceleration of driving straight."""
