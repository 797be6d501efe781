"""As a vehicle's file has it."""

import math
from typing import Literal

from touchline.schemas.vehicles import Actuator, DriveSpec, GroundContact

WHEELS = ("front-left", "front-right", "rear-left", "rear-right")


class SkidSteerDrive(DriveSpec):
    """Four driven wheels in a rectangle, the frame's origin in its middle.

    Tyres of one stiffness along and another across turn it about a track that is wider than what is between them.
    """

    kind: Literal["skid-steer"] = "skid-steer"
    wheel_radius_m: float = 0.1
    track_width_m: float = 0.5
    wheelbase_m: float = 0.12
    skid: float = 1.3
    """Of the tyres, stiffness across over that along."""
    max_wheel_speed_radps: float = 20.0
    max_wheel_acceleration_radps2: float = 40.0
    planned_wheel_acceleration_radps2: float = 12.0
    motor_time_constant_s: float = 0.05
    encoder_rad: float = 1e-4
    transit_speed_mps: float = 0.8
    max_acceleration_mps2: float = 0.7
    max_lateral_acceleration_mps2: float = 0.4
    can_spin: bool = True

    @property
    def half_turning_m(self) -> float:
        """Half of the track about which it turns: where as much is pushed along as is dragged across."""
        half = 0.5 * self.track_width_m
        return half + self.skid * (0.5 * self.wheelbase_m) ** 2 / half

    @property
    def wheels_m(self) -> tuple[tuple[float, float], ...]:
        """Places where they touch the ground."""
        x, y = 0.5 * self.wheelbase_m, 0.5 * self.track_width_m
        return (x, y), (x, -y), (-x, y), (-x, -y)

    @property
    def max_speed_mps(self) -> float:
        return self.max_wheel_speed_radps * self.wheel_radius_m

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        limits = self.max_wheel_speed_radps, self.max_wheel_acceleration_radps2
        return tuple(
            Actuator(
                name,
                "wheel speed",
                "rad/s",
                "wheel acceleration",
                *limits,
                f"{name.replace('-', '_')}_wheel",
                self.encoder_rad,
            )
            for name in WHEELS
        )

    @property
    def contacts(self) -> tuple[GroundContact, ...]:
        return tuple(GroundContact(x, y, 0.06, self.wheel_radius_m) for x, y in self.wheels_m)

    @property
    def encoder_mps(self) -> float:
        """Quantisation of a rim's speed in a tick."""
        return math.sqrt(1.0 / 6.0) * self.encoder_rad * self.wheel_radius_m / 0.01
