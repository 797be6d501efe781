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
    constant_nm_per_a: Annotated[float, Field(ge=0.0001, le=100)] = 0.1
    resistance_ohm: Annotated[float, Field(ge=0.0001, le=1_000)] = 0.01
    max_current_a: Annotated[float, Field(ge=0.01, le=10_000)] = 300.0
    inertia_kgm2: Annotated[float, Field(ge=0.0001, le=100)] = 90.0
    """Of the drum, 0.7 t in its shell, with gear and rotor."""
    friction_nm: Annotated[float, Field(ge=0, le=1_000)] = 40.0
    viscous_nms: Annotated[float, Field(ge=0, le=100)] = 5.0


class RearSteeredDrive(DriveSpec):
    """The body frame's origin is the middle of the drum's axle; the wheel steers on the centre line, behind it.

    With the steering angle δ, positive to the left, κ = −tan δ / wheelbase, forward and backward alike. Wheelbase,
    widths, rates and lags are assumed: the study of the clay roller that this is made for names the largest steering
    angle, speed and acceleration only.
    """

    kind: Literal["rear-steered"] = "rear-steered"
    transit_speed_mps: Speed = 1.0
    max_acceleration_mps2: Acceleration = 0.1
    max_lateral_acceleration_mps2: Acceleration = 0.5
    default_kappa_max_1pm: Annotated[float, Field(gt=0, le=100)] = 0.27
    default_sigma_max_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 0.25

    wheelbase_m: Track = 2.0
    """From the drum's axle to the steered wheel's."""
    drum_radius_m: Wheel = 0.4
    drum_width_m: Length = 2.2
    top_speed_mps: Speed = 1.0
    """No plan is faster."""
    max_drum_speed_radps: WheelRate = 2.75
    """The motor's limit, with something left for slip at the top speed."""
    max_drum_acceleration_radps2: WheelAcceleration = 2.5
    """The same: emergency stops use it, plans keep to `max_acceleration_mps2`."""
    drum_time_constant_s: Delay = 0.2
    """Of the drum's speed profile."""
    motor: DrumMotor = DrumMotor()
    encoder_ticks_per_revolution: Annotated[int, Field(gt=0, le=1_000_000_000)] = 4096 * 100
    """Of the drum: 1024 lines × 4 on the motor shaft behind a 100:1 gear."""

    max_steering_rad: Annotated[float, Field(ge=0.01, le=1.2)] = 0.5
    """Plans keep to it, to either side."""
    max_steering_rate_radps: Annotated[float, Field(ge=0.01, le=10)] = 0.5
    """The same."""
    steering_reserve: Annotated[float, Field(ge=0, le=0.25)] = 0.15
    """Share of both that the steering has on top, to correct while a plan is at its limit."""
    steering_time_constant_s: Delay = 0.2
    """With which the angle follows its command, as long as the rate lets it."""
    steering_encoder_rad: Annotated[float, Field(ge=0.000001, le=0.1)] = 0.0017
    """Between two counts."""
    steering_offset_rad: Annotated[float, Field(ge=0, le=0.2)] = 0.0175
    """1 σ: how well straight ahead was adjusted, as the robot's own computer assumes it."""
    side_slip_rad_per_mps2: Annotated[float, Field(ge=0, le=1)] = 0.0064
    """Sideways slip angle per lateral acceleration on clay, as the computer assumes it."""
    drum_load_share: Annotated[float, Field(ge=0.05, le=0.95)] = 0.7
    """Of the weight; the rest is on the steered wheel."""
    rear_wheel_radius_m: Wheel = 0.35
    rear_wheel_width_m: Length = 0.4

    says_no_more: ClassVar[str] = "the drive does no more (top_speed_mps)"

    @property
    def max_speed_mps(self) -> float:
        """The same whichever way the wheel steers: the drum is on the axle that does not."""
        return self.top_speed_mps

    @property
    def steering_stop_rad(self) -> float:
        """Where the mechanism ends."""
        return self.max_steering_rad * (1.0 + self.steering_reserve)

    @property
    def steering_rate_limit_radps(self) -> float:
        """What the mechanism does at most."""
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
