"""A driven drum in front and a steered wheel behind it: a roller."""

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from touchline.schemas.misfit import misfit
from touchline.schemas.vehicles.actuator import Actuator
from touchline.schemas.vehicles.differential_drive import Motor
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.ground_contact import GroundContact
from touchline.schemas.vehicles.quantities import (
    Acceleration,
    Delay,
    Length,
    Speed,
    Track,
    Wheel,
    WheelAcceleration,
    WheelRate,
)


class DrumMotor(Motor):
    """As the drum feels it. Nothing of it is published: it moves 2.5 t on clay, up a slope of 10 %, too."""

    gear_ratio: Annotated[float, Field(ge=0.1, le=1_000)] = 100.0
    """Motor turns for each turn of the drum."""
    constant_nm_per_a: Annotated[float, Field(ge=0.0001, le=100)] = 0.1
    """Torque constant; also V per rad/s."""
    resistance_ohm: Annotated[float, Field(ge=0.0001, le=1_000)] = 0.01
    """Resistance of the winding."""
    max_current_a: Annotated[float, Field(ge=0.01, le=10_000)] = 300.0
    """Limit of the amplifier: 2.55 kN m at the drum."""
    inertia_kgm2: Annotated[float, Field(ge=0.0001, le=100)] = 90.0
    """Inertia of drum (0.7 t in its shell), gear and rotor."""
    friction_nm: Annotated[float, Field(ge=0, le=1_000)] = 40.0
    """Dry friction, at the drum."""
    viscous_nms: Annotated[float, Field(ge=0, le=100)] = 5.0
    """Viscous friction, at the drum."""


class RearSteeredDrive(DriveSpec):
    """The body frame's origin is the middle of the drum's axle; the wheel steers on the centre line, behind it.

    With the steering angle δ, positive to the left, κ = −tan δ / wheelbase, forward and backward alike. Wheelbase,
    widths, rates and lags are assumed: the study of the clay roller that this is made for names the largest steering
    angle, speed and acceleration only.
    """

    kind: Literal["rear-steered"] = "rear-steered"
    """A driven drum, and a steered wheel behind it."""
    transit_speed_mps: Speed = 1.0
    """Planned speed where nothing is worked on (study)."""
    max_acceleration_mps2: Acceleration = 0.1
    """Planned acceleration along the path (study)."""
    max_lateral_acceleration_mps2: Acceleration = 0.5
    """Planned acceleration across the path; the tightest turn at 1 m/s takes 0.27."""
    default_kappa_max_1pm: Annotated[float, Field(gt=0, le=100)] = 0.27
    """Largest curvature of `ccd` and `dubins-padded`."""
    default_sigma_max_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 0.25
    """Largest sharpness of `ccd` and `dubins-padded`."""

    wheelbase_m: Track = 2.0
    """Distance of the drum's axle from the wheel's; each seed has its own error."""
    drum_radius_m: Wheel = 0.4
    """Nominal radius; each seed has its own error."""
    drum_width_m: Length = 2.2
    """Width of the drum on the ground."""
    top_speed_mps: Speed = 1.0
    """Highest speed of any plan (study)."""
    max_drum_speed_radps: WheelRate = 2.75
    """Limit of the drum's speed, with a reserve for slip."""
    max_drum_acceleration_radps2: WheelAcceleration = 2.5
    """Limit of the drum's acceleration; emergency stops use it."""
    drum_time_constant_s: Delay = 0.2
    """Lag of the drum behind its command."""
    motor: DrumMotor = DrumMotor()
    encoder_ticks_per_revolution: Annotated[int, Field(gt=0, le=1_000_000_000)] = 4096 * 100
    """Encoder ticks per turn of the drum.

    1024 lines × 4 on the motor shaft behind a 100:1 gear.
    """

    max_steering_rad: Annotated[float, Field(ge=0.01, le=1.2)] = 0.5
    """Largest steering angle of plans, to either side (study)."""
    max_steering_rate_radps: Annotated[float, Field(ge=0.01, le=10)] = 0.5
    """Largest steering rate of plans."""
    steering_reserve: Annotated[float, Field(ge=0, le=0.25)] = 0.15
    """Share of both that the steering has on top, for corrections."""
    steering_time_constant_s: Delay = 0.2
    """Lag of the angle behind its command."""
    steering_encoder_rad: Annotated[float, Field(ge=0.000001, le=0.1)] = 0.0017
    """Angle between two counts: 0.1°."""
    steering_offset_rad: Annotated[float, Field(ge=0, le=0.2)] = 0.0175
    """Error of straight ahead, 1 σ, as the computer assumes it: 1°."""
    side_slip_rad_per_mps2: Annotated[float, Field(ge=0, le=1)] = 0.0064
    """Slip angle per lateral acceleration, as the computer assumes it: 1/(g·16)."""
    drum_load_share: Annotated[float, Field(ge=0.05, le=0.95)] = 0.7
    """Share of the weight on the drum; the wheel bears the rest."""
    rear_wheel_radius_m: Wheel = 0.35
    """Radius of the steered wheel."""
    rear_wheel_width_m: Length = 0.4
    """Width of the steered wheel on the ground."""

    says_no_more: ClassVar[str] = "the drive does no more (top_speed_mps)"

    @property
    def max_speed_mps(self) -> float:
        """The same whichever way the wheel steers: the drum is on the axle that does not."""
        return self.top_speed_mps

    @property
    def steering_stop_rad(self) -> float:
        """Steering angle at which the mechanism ends."""
        return self.max_steering_rad * (1.0 + self.steering_reserve)

    @property
    def steering_rate_limit_radps(self) -> float:
        """Highest steering rate of the mechanism."""
        return self.max_steering_rate_radps * (1.0 + self.steering_reserve)

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """Drum and steering."""
        drum = self.max_drum_speed_radps, self.max_drum_acceleration_radps2
        steering = self.steering_stop_rad, self.steering_rate_limit_radps
        count_rad = 2.0 * math.pi / self.encoder_ticks_per_revolution
        return (
            Actuator("drum", "wheel speed", "rad/s", "wheel acceleration", *drum, "drum", count_rad),
            Actuator(
                "steering",
                "steering angle",
                "rad",
                "steering rate",
                *steering,
                "rear_steering",
                self.steering_encoder_rad,
            ),
        )

    def steering_rad(self, speed_mps: float, yaw_rate_radps: float) -> float | None:
        """The rear wheel's."""
        return -math.atan(self.wheelbase_m * yaw_rate_radps / speed_mps) if speed_mps else None

    @property
    def contacts(self) -> tuple[GroundContact, ...]:
        """The drum's halves, left and right, and the steered wheel."""
        half_m = 0.5 * self.drum_width_m
        drum = (GroundContact(0.0, side * 0.5 * half_m, half_m, self.drum_radius_m) for side in (1.0, -1.0))
        return *drum, GroundContact(-self.wheelbase_m, 0.0, self.rear_wheel_width_m, self.rear_wheel_radius_m)

    @model_validator(mode="after")
    def _can_do_what_it_says(self) -> Self:
        if self.can_spin:
            raise misfit("can_spin", True, "give false: it has no way to turn on the spot")
        most_mps = self.max_drum_speed_radps * self.drum_radius_m
        if self.top_speed_mps > most_mps:
            remedy = f"give at most {most_mps:.10g} m/s: the drum does no more (max_drum_speed_radps · drum_radius_m)"
            raise misfit("top_speed_mps", self.top_speed_mps, remedy)
        return self
