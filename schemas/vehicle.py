"""Vehicles: a robot as data. The defaults are the Turf Tank Two."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from touchline.schemas.spec import Spec

# What is out of these bounds was meant in another unit, or is no robot that the physics' steps of 1 ms can follow.
Length = Annotated[float, Field(ge=0.001, le=10)]
Wheel = Annotated[float, Field(ge=0.02, le=2)]
Track = Annotated[float, Field(ge=0.05, le=10)]
Place = Annotated[float, Field(ge=-10, le=10)]
BodyPoint = tuple[Place, Place]
Mass = Annotated[float, Field(ge=1, le=10_000)]
WheelRate = Annotated[float, Field(ge=0.1, le=1_000)]
WheelAcceleration = Annotated[float, Field(ge=0.1, le=10_000)]
Acceleration = Annotated[float, Field(ge=0.01, le=100)]
Delay = Annotated[float, Field(ge=0, le=10)]
Speed = Annotated[float, Field(ge=0.05, le=20)]


class Motor(Spec):
    """A DC motor with its gear and amplifier, as one wheel feels it.

    The maker publishes none of this. The defaults are a common 36 V, 20:1 gear motor that reaches the known limits
    of wheel speed and acceleration with a full tank, and uses the known energy on grass.
    """

    gear_ratio: Annotated[float, Field(ge=0.1, le=1_000)] = 20.0
    gear_efficiency: Annotated[float, Field(gt=0, le=1)] = 0.85
    constant_nm_per_a: Annotated[float, Field(ge=0.0001, le=100)] = 0.08
    """Torque constant, and the electromotive force in V per rad/s."""
    resistance_ohm: Annotated[float, Field(ge=0.0001, le=1_000)] = 0.25
    max_current_a: Annotated[float, Field(ge=0.01, le=10_000)] = 25.0
    inertia_kgm2: Annotated[float, Field(ge=0.0001, le=100)] = 0.08
    """Of wheel, gear and rotor, at the wheel."""
    friction_nm: Annotated[float, Field(ge=0, le=1_000)] = 0.4
    """Dry, at the wheel."""
    viscous_nms: Annotated[float, Field(ge=0, le=100)] = 0.02


class Vehicle(Spec):
    """A differential-drive line marker; the body frame's origin is the middle of the wheel axle (REP-103)."""

    name: str = "turf-tank-two"
    kinematics: Literal["differential"] = "differential"

    wheel_radius_m: Wheel = 0.1
    track_width_m: Track = 0.5079
    max_wheel_speed_radps: WheelRate = 20.0
    max_wheel_acceleration_radps2: WheelAcceleration = 40.0
    motor_time_constant_s: Delay = 0.05
    """Of the drives' speed profile: how the wheels follow their command as long as the motors can."""
    motor: Motor = Motor()
    mass_empty_kg: Mass = 56.0
    mass_full_kg: Mass = Field(default=100.0, validate_default=True)
    radius_of_gyration_m: Length = 0.3
    caster_x_m: Place = 0.5
    """The casters, taken together, ahead of the axle."""
    caster_trail_m: Length = 0.05
    caster_load_share: Annotated[float, Field(ge=0, lt=1)] = 0.2
    """Share of the weight on the casters."""
    side_slip_rad_per_mps2: Annotated[float, Field(ge=0, le=1)] = 0.0064
    """Sideways slip angle per lateral acceleration on dry grass, as the robot's own computer assumes it."""
    max_acceleration_mps2: Acceleration = 1.0
    """Planned acceleration along the path: what a full tank and grass bear without slipping or slopping."""
    planned_wheel_acceleration_radps2: WheelAcceleration = 16.0
    """Of the wheels' limit, what plans use: turning in harder makes tyres slip on grass, and a pitch takes no less."""
    max_lateral_acceleration_mps2: Acceleration = 1.2
    """Planned acceleration across the path: what tyres on grass bear with hardly any slip. (The study's 1.5 m/s in
    turns of 1.125 1/m need 2.53 m/s², at which the emulated robot slides.)"""
    can_reverse: bool = True
    can_spin: bool = True
    """What the robot's own computer drives: segments of direction BACKWARD, turns on the spot (ANGULAR velocity)."""

    footprint_m: Annotated[tuple[BodyPoint, ...], Field(min_length=3, max_length=100)] = (
        (0.75, -0.33),
        (0.75, 0.33),
        (-0.35, 0.33),
        (-0.35, -0.33),
        (-0.15, -0.33),
        (-0.15, -0.50),
        (0.15, -0.50),
        (0.15, -0.33),
    )
    """Outline of the body with the nozzle's boom, corner by corner (x, y)."""
    casters_m: Annotated[tuple[BodyPoint, ...], Field(max_length=10)] = ((0.60, 0.20), (0.60, -0.20))
    """Where the casters touch the ground; the wheels do at y = ± half the track."""

    nozzle_x_m: Place = 0.0
    nozzle_y_m: Place = -0.41124
    spray_width_m: Length = 0.12
    paint_l_per_m: Annotated[float, Field(gt=0, le=10)] = 0.0077
    """Paint for a metre of line: 20 L make about one American football field (2.6 km of line)."""
    tank_l: Annotated[float, Field(gt=0, le=10_000)] = 20.0
    valve_on_delay_s: Delay = 0.015
    valve_off_delay_s: Delay = 0.030
    disc_delay_s: Delay = 0.5
    drying_time_s: Annotated[float, Field(gt=0, le=1_000_000)] = 900.0
    """Until then wheels and casters smear the paint (the no-pick-up time of ASTM D711, on grass)."""
    smear_share: Annotated[float, Field(ge=0, le=1)] = 0.5
    """Of fresh paint that is rolled over, so much sticks to the tread; less as it dries. 0: none ever does."""
    smear_length_m: Annotated[float, Field(gt=0, le=100)] = 1.0
    """Way over which the paint on a tread falls to 1/e."""
    wheel_width_m: Length = 0.08
    caster_width_m: Length = 0.05
    """Of the treads, on the ground."""
    caster_radius_m: Wheel = 0.075

    battery_wh: Annotated[float, Field(gt=0, le=1_000_000)] = 680.0
    idle_power_w: Annotated[float, Field(ge=0, le=100_000)] = 45.0
    """Computer, receiver, pump; with what the motors draw on grass the battery lasts a bit over 5 h of work."""

    encoder_ticks_per_revolution: Annotated[int, Field(gt=0, le=1_000_000_000)] = 4096 * 20
    """1024 lines × 4 on the motor shaft behind a 20:1 gear."""
    gnss_antenna_x_m: Place = 0.0
    gnss_antenna_y_m: Place = 0.0
    gnss_antenna_z_m: Place = 0.6

    paint_speed_mps: Speed = Field(default=1.0, validate_default=True)
    transit_speed_mps: Speed = Field(default=1.4, validate_default=True)
    default_kappa_max_1pm: Annotated[float, Field(gt=0, le=100)] = 1.125
    default_sigma_max_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 2.1

    @field_validator("mass_full_kg")
    @classmethod
    def _paint_weighs_something(cls, given: float, info: ValidationInfo) -> float:
        empty = info.data.get("mass_empty_kg", given)
        if given < empty:
            raise ValueError(f"give at least {empty:g} kg, the mass_empty_kg")
        return given

    @field_validator("paint_speed_mps", "transit_speed_mps")
    @classmethod
    def _speeds_fit_the_wheels(cls, given: float, info: ValidationInfo) -> float:
        known = info.data
        limit = known.get("max_wheel_speed_radps", 0.0) * known.get("wheel_radius_m", 0.0)
        if 0.0 < limit < given:
            raise ValueError(
                f"give at most {limit:.10g} m/s: the wheels do no more (max_wheel_speed_radps times wheel_radius_m)"
            )
        return given

    @property
    def half_track_m(self) -> float:
        """Distance of a wheel from the axle's middle."""
        return self.track_width_m / 2

    @property
    def wheels_m(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the wheels, left and right, touch the ground, in the body's frame."""
        return (0.0, self.half_track_m), (0.0, -self.half_track_m)

    @property
    def max_rim_speed_mps(self) -> float:
        """Speed of the robot with both wheels at their limit."""
        return self.max_wheel_speed_radps * self.wheel_radius_m
