"""The planner's interface to drives of any kind."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, NamedTuple

from touchline.core.jit import kernel_of_class
from touchline.schemas.plugins import DRIVES, part_for

if TYPE_CHECKING:
    from touchline.schemas.vehicles import Vehicle
    from touchline.services.planner.geometry.clothoid import Floats


class ActuatorMotion(NamedTuple):
    """What k actuators do at places along a path.

    Attributes:
        value: (k, …) of each of the drive's `actuators`: a wheel's rate (rad/s), a steering angle (rad).
        rate: (k, …) how fast that changes, per second.
    """

    value: Floats
    rate: Floats


class PlannedDrive(ABC):
    """The drive of a vehicle, as plans see it. Speeds are of the body frame's origin.

    Attributes:
        caps: A named tuple of figures whose class has the kernels `square_cap`, `gain` and `spin_lever_m` (see below):
            what compiled code takes of the drive.
        max_speed_mps: The largest speed straight ahead.
        acceleration_mps2: The largest acceleration straight ahead.
        curvature_max_1pm: No path is tighter.
        tightest_1pm: What turns use of that where the options do not say.
    """

    caps: Any
    max_speed_mps: float
    acceleration_mps2: float
    curvature_max_1pm: float
    tightest_1pm: float

    @abstractmethod
    def curvature_at(self, speed_mps: float) -> float:
        """The tightest curvature (1/m) at a speed."""

    @abstractmethod
    def sharpness_at(self, speed_mps: float) -> float:
        """The sharpness (1/m²) of turns at a constant speed, with acceleration left for braking and speeding up."""

    @abstractmethod
    def turns_within(self, lateral_mps2: float) -> bool:
        """Whether the drive alone keeps every turn within an acceleration across the path."""

    @abstractmethod
    def least_s(self, length_m: float, turned_rad: float) -> float:
        """A lower bound (s) on the time of any path of this length that turns by this angle (rad) in all."""

    @abstractmethod
    def actuation(
        self,
        direction: Floats,
        square: Floats,
        acceleration_mps2: Floats,
        curvature_1pm: Floats,
        sharpness_1pm2: Floats,
    ) -> ActuatorMotion:
        """What the actuators do at places along a path; all arguments have one shape.

        Args:
            direction: 1 forward, -1 backward.
            square: v² (m²/s²).
            acceleration_mps2: Of |v|.
            curvature_1pm: Of the path, dθ/ds, where s falls when it is driven backward.
            sharpness_1pm2: Change of curvature per metre driven.
        """

    @abstractmethod
    def spinning(self, rate_radps: float) -> Floats:
        """(k, 1) the actuators' values for a rate of turning on the spot; for an angular acceleration, their rates."""

    @abstractmethod
    def power_w(self, speed_mps: Floats, yaw_rate_radps: Floats, mass_kg: Floats, step_s: float) -> Floats:
        """The power (W) (n,) drawn at speeds, yaw rates and masses (n,) that are sampled every `step_s`."""


def planned_drive(vehicle: Vehicle) -> PlannedDrive:
    """The planner's side of a vehicle's drive, chosen by the drive's kind.

    Raises:
        SpecError: The kind cannot be planned for.
    """
    found: PlannedDrive = part_for(DRIVES, vehicle.drive.kind, "planner")(vehicle)
    return found


@kernel_of_class
def square_cap(caps: Any, curvature: float, sharpness: float) -> float:  # type: ignore[empty-body]
    """The largest u = v² (m²/s²) that the drive can keep throughout a stretch.

    Args:
        caps: `PlannedDrive.caps`; the kernel of its class is called.
        curvature: The largest |curvature| of the stretch (1/m).
        sharpness: Its |sharpness| (1/m²).
    """


@kernel_of_class
def gain(  # type: ignore[empty-body]
    caps: Any, square: float, curvature: float, sharpness: float, length: float
) -> float:
    """The largest acceleration (m/s²) that the drive can keep throughout a stretch; may be negative.

    Args:
        caps: `PlannedDrive.caps`; the kernel of its class is called.
        square: u = v² (m²/s²) at the beginning of the stretch.
        curvature: Signed, at its beginning (1/m).
        sharpness: Signed, constant (1/m²).
        length: Of the stretch (m).
    """


@kernel_of_class
def spin_lever_m(caps: Any) -> float:  # type: ignore[empty-body]
    """How far from the origin (m) a turn on the spot is as fast, and accelerates as hard, as driving straight on."""
