"""Two driven wheels on one axle, and casters."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from touchline.schemas.spec import GrownSpec, Spec
from touchline.schemas.vehicles.actuator import Actuator
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.ground_contact import GroundContact
from touchline.schemas.vehicles.quantities import (
    BodyPoint,
    Delay,
    Length,
    Place,
    Track,
    Wheel,
    WheelAcceleration,
    WheelRate,
)


class Motor(Spec):
    """A DC motor with its gear and amplifier, as one wheel feels it.

    The maker publishes none of this. The defaults are a common 36 V, 20:1 gear motor that reaches the known limits
    of wheel speed and acceleration with a full tank, and uses the known energy on grass.
    """

    gear_ratio: Annotated[float, Field(ge=0.1, le=1_000)] = 20.0
    """Motor turns for each turn of the wheel."""
    gear_efficiency: Annotated[float, Field(gt=0, le=1)] = 0.85
    """Share of the torque that arrives."""
    constant_nm_per_a: Annotated[float, Field(ge=0.0001, le=100)] = 0.08
    """Torque constant; also V per rad/s."""
    resistance_ohm: Annotated[float, Field(ge=0.0001, le=1_000)] = 0.25
    """Resistance of the winding."""
    max_current_a: Annotated[float, Field(ge=0.01, le=10_000)] = 25.0
    """Limit of the amplifier."""
    inertia_kgm2: Annotated[float, Field(ge=0.0001, le=100)] = 0.08
    """Inertia of wheel, gear and rotor, at the wheel."""
    friction_nm: Annotated[float, Field(ge=0, le=1_000)] = 0.4
    """Dry friction, at the wheel."""
    viscous_nms: Annotated[float, Field(ge=0, le=100)] = 0.02
    """Viscous friction, at the wheel."""


class DifferentialDrive(GrownSpec, DriveSpec):
    """Two driven wheels; the body frame's origin is the middle of their axle (REP-103)."""

    kind: Literal["differential"] = "differential"
    """Two driven wheels on one axle."""
    wheel_radius_m: Wheel = 0.1
    """Nominal radius; each seed has its own error."""
    track_width_m: Track = 0.5079
    """Distance from wheel to wheel."""
    max_wheel_speed_radps: WheelRate = 20.0
    """Limit of the wheels' speed."""
    max_wheel_acceleration_radps2: WheelAcceleration = 40.0
    """Limit of the wheels' acceleration."""
    max_yaw_rate_radps: Annotated[float, Field(ge=0.1, le=100)] = 20.0
    """Limit of the yaw rate, which plans keep to.

    Sessions have it only if it is another figure than this, which is more than most wheels do. Vehicles without a limit
    of their own, and the hashes of their setups, are thus what they were before.
    """
    motor_time_constant_s: Delay = 0.05
    """Lag of a wheel behind its command."""
    motor: Motor = Motor()
    encoder_ticks_per_revolution: Annotated[int, Field(gt=0, le=1_000_000_000)] = 4096 * 20
    """Encoder ticks per turn of the wheel.

    1024 lines × 4 on the motor shaft behind a 20:1 gear.
    """
    planned_wheel_acceleration_radps2: WheelAcceleration = 16.0
    """Wheel acceleration that plans use.

    Turning in harder makes tyres slip on grass, and a pitch takes no less time.
    """
    can_spin: bool = True
    """Plans may turn on the spot."""
    side_slip_rad_per_mps2: Annotated[float, Field(ge=0, le=1)] = 0.0064
    """Slip angle per lateral acceleration, as the computer assumes it."""
    wheel_width_m: Length = 0.08
    """Width of a wheel's tread."""

    caster_x_m: Place = 0.5
    """The casters, taken together, ahead of the axle."""
    caster_trail_m: Length = 0.05
    """Distance of the contact behind the caster's pivot."""
    caster_load_share: Annotated[float, Field(ge=0, lt=1)] = 0.2
    """Share of the weight on the casters."""
    casters_m: Annotated[tuple[BodyPoint, ...], Field(max_length=10)] = ((0.60, 0.20), (0.60, -0.20))
    """Contacts of the casters with the ground (x, y)."""
    caster_width_m: Length = 0.05
    """Width of a caster's tread."""
    caster_radius_m: Wheel = 0.075
    """Radius of a caster."""

    says_no_more: ClassVar[str] = "the wheels do no more (max_wheel_speed_radps times wheel_radius_m)"

    later_fields = ("max_yaw_rate_radps",)

    @property
    def half_track_m(self) -> float:
        """Distance of a wheel from the axle's middle."""
        return self.track_width_m / 2

    @property
    def spin_lever_m(self) -> float:
        """Distance from the axle's middle at which a turn on the spot is as fast as straight driving: half the track.

        More where the yaw rate has a limit of its own.
        """
        return max(self.half_track_m, self.max_speed_mps / self.max_yaw_rate_radps)

    @property
    def wheels_m(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Contacts of the left and right wheel with the ground, in the body's frame."""
        return (0.0, self.half_track_m), (0.0, -self.half_track_m)

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """The left and the right wheel."""
        limits = self.max_wheel_speed_radps, self.max_wheel_acceleration_radps2
        count_rad = 2.0 * math.pi / self.encoder_ticks_per_revolution
        return tuple(
            Actuator(side, "wheel speed", "rad/s", "wheel acceleration", *limits, f"{side}_wheel", count_rad)
            for side in ("left", "right")
        )

    @property
    def contacts(self) -> tuple[GroundContact, ...]:
        """The wheels, left and right, and the casters."""
        wheels = (GroundContact(x, y, self.wheel_width_m, self.wheel_radius_m) for x, y in self.wheels_m)
        casters = (GroundContact(x, y, self.caster_width_m, self.caster_radius_m, True) for x, y in self.casters_m)
        return *wheels, *casters

    @property
    def max_speed_mps(self) -> float:
        """With both wheels at their limit."""
        return self.max_wheel_speed_radps * self.wheel_radius_m
