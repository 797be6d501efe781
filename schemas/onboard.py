"""Configuration of the robot's computer: sensor data sheets, follower and limits.

The defaults are the shipped robot's. None of it decides what is true: that is the scenario's, of which the robot's
computer sees nothing but what its sensors say.
"""

from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    model_validator,
)

from touchline.schemas.plugins import FOLLOWERS, UnknownPlugin
from touchline.schemas.spec import GrownSpec, Spec


def _registered(name: str) -> str:
    try:
        return FOLLOWERS.known(name)
    except UnknownPlugin as error:
        raise ValueError(error.remedy) from error


Follower = Annotated[str, AfterValidator(_registered)]
"""The name of a follower that is registered in `FOLLOWERS`."""
Deviation = Annotated[float, Field(ge=0, le=1_000)]
Seconds = Annotated[float, Field(gt=0, le=1_000_000)]


class GnssSheet(GrownSpec):
    """The RTK-GNSS receiver with corrections: errors per horizontal axis (1 σ), rate and delay."""

    white_m: Deviation = 0.00471
    gauss_markov_1_m: Deviation = 0.0025
    gauss_markov_1_tau_s: Seconds = 115.0
    gauss_markov_2_m: Deviation = 0.0025
    gauss_markov_2_tau_s: Seconds = 900.0
    rate_hz: Literal[1, 2, 5, 10, 20] = 10
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.11
    latency_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.01
    jump_fixes: Annotated[int, Field(ge=10, le=1000)] | None = None
    """Outlying fixes in a row after which the estimator itself accepts that the receiver has jumped; by default only an
    operator's `resume` does."""

    later_fields = ("jump_fixes",)


class CameraSheet(Spec):
    """The camera overhead: errors of a pose along an axis and of its heading (1 σ), rate and delay."""

    white_m: Deviation = 0.01
    white_rad: Deviation = 0.01745
    rate_hz: Annotated[int, Field(ge=1, le=100)] = 15
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.08
    latency_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.02


class OdometrySheet(Spec):
    """Odometry alone: how well the start pose is known (1 σ an axis; heading), and what nothing can correct later."""

    start_sigma_m: Annotated[float, Field(ge=0.0001, le=100)] = 0.01
    start_sigma_rad: Annotated[float, Field(ge=0.0001, le=1)] = 0.01745
    scale_relative: Annotated[float, Field(ge=0, le=0.5)] = 0.005
    """1 σ of the wheels' radius and lasting slip: how much longer or shorter a way is than they count."""
    max_sigma_m: Annotated[float, Field(gt=0, le=10_000)] | None = None
    """Of the position, beyond which the robot does not drive; by default it drives however unsure it is."""


class ImuSheet(Spec):
    """Gyroscope and accelerometer: densities, bias walk, drift with temperature (1 σ), and how warm they get."""

    gyro_density_radps_rthz: Deviation = 0.000244
    gyro_bias_walk_radps_rts: Deviation = 0.00001
    gyro_temperature_radps_per_k: Deviation = 0.00009
    accel_density_mps2_rthz: Deviation = 0.001716
    accel_turn_on_bias_mps2: Deviation = 0.196
    accel_bias_walk_mps2_rts: Deviation = 0.0002
    accel_temperature_mps2_per_k: Deviation = 0.002
    warming_k: Deviation = 15.0
    warming_tau_s: Seconds = 600.0


class MagnetometerSheet(Spec):
    """The magnetometer as built in: white noise, hard iron and disturbances of the surroundings (1 σ, as heading)."""

    white_rad: Deviation = 0.01
    bias_rad: Deviation = 0.04
    disturbance_rad: Deviation = 0.04
    disturbance_tau_s: Seconds = 20.0


class DriveSheet(GrownSpec):
    """How far the wheels slip on the ground that the robot is meant for (1 σ), and how well its track is known."""

    track_width_relative: Deviation = 0.002
    slip_relative: Deviation = 0.02
    slip_tau_s: Seconds = 0.5
    side_slip_m_rtm: Deviation = 0.001
    """How far it drifts sideways, as a random walk: 1 σ after a metre."""

    later_fields = ("side_slip_m_rtm",)


class FenceLimits(Spec):
    """How far any part of the robot's body may leave the fence, and for how long, before it stops hard."""

    margin_m: Annotated[float, Field(ge=0, le=1000)] = 2.0
    """Beyond the convex hull of what the body sweeps along the plan, for a template without a boundary."""
    boundary_margin_m: Annotated[float, Field(ge=0, le=1000)] = 0.1
    """Beyond a template's boundary."""
    timeout_s: Annotated[float, Field(ge=0.01, le=10)] = 0.2
    """In sim time."""


class LanePursuit(Spec):
    """What the follower `pursuit-lanes` steers and drives by; the defaults are those of the study that it is from."""

    lookahead_m: Annotated[float, Field(gt=0, le=100)] = 5.0
    min_speed_mps: Annotated[float, Field(gt=0, le=10)] = 0.1
    max_speed_mps: Annotated[float, Field(gt=0, le=10)] = 1.0
    acceleration_mps2: Annotated[float, Field(gt=0, le=10)] = 0.1
    tolerance_m: Annotated[float, Field(ge=0, le=10)] = 0.2
    """To a lane's end, within which the lane is done and is rolled out, slower than `min_speed_mps` too."""
    steer_first: bool = False
    """Whether it stands at the begin of a lane until the steering is where it is wanted."""

    @model_validator(mode="after")
    def _sets_off_slower(self) -> Self:
        if self.min_speed_mps > self.max_speed_mps:
            raise ValueError("min_speed_mps must be at most max_speed_mps")
        return self


class TrackingGains(Spec):
    """Gains of the followers that track time, and of `frenet`, which keeps to the path."""

    frequency_radps: Annotated[float, Field(gt=0, le=20)] = 1.0
    """Natural frequency a of `linear`, `regularised` and `dynamic`."""
    damping: Annotated[float, Field(gt=0, le=10)] = 1.0
    """ζ of all that track time."""
    scale_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 10.0
    """b of `linear-scaled` and `nonlinear`."""
    slow_mps: Annotated[float, Field(gt=0, le=1)] = 0.02
    """v_ε of `regularised`, and the speed below which `dynamic` counts as resting."""
    lateral_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 4.0
    """k_a of `frenet`."""
    heading_1ps: Annotated[float, Field(gt=0, le=100)] = 4.0
    """k_b of `frenet`."""


class MoveOffLimits(Spec):
    """How long the robot warns before it moves off, and after how long a stop only a person may end it."""

    warning_s: Annotated[float, Field(ge=2, le=60)] = 2.0
    """After a pause, in sim time."""
    start_warning_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    """After a start, a goal, or the begin of guidance, in sim time. The emulated robot sets off at once: give a real
    machine at least 2 s."""
    person_after_s: Annotated[float, Field(gt=0, le=1_000_000)] | None = None
    """Longest stop, in sim time, that the robot ends by itself; a longer one is ended by `resume` only. By default 30 s
    for a robot with a tool or of more than 20 kg, and no limit for others."""


class TeamLimits(Spec):
    """How a robot keeps to the cells in which a team's coordinator guides it."""

    lease_s: Annotated[float, Field(gt=0, le=60)] = 1.0
    """It brakes when it has not been told for so long that it is heard; the coordinator counts on that."""
    doubt_m: Annotated[float, Field(ge=0, le=1)] = 0.005
    """By how much it may believe itself outside of a cell that it takes; part of the radius that is kept free."""
    there_m: Annotated[float, Field(gt=0, le=1)] = 0.01
    """So near to its target it stands…"""
    away_m: Annotated[float, Field(gt=0, le=1)] = 0.02
    """…until that is so far away."""

    @model_validator(mode="after")
    def _sets_off_farther_away(self) -> Self:
        if self.there_m > self.away_m:
            raise ValueError("there_m must be at most away_m")
        return self


class OnboardConfig(GrownSpec):
    """The robot's own computer: what follows the path, what it is told of its sensors, when it stops by itself."""

    follower: Follower = FOLLOWERS.default
    gnss: GnssSheet = GnssSheet()
    camera: CameraSheet = CameraSheet()
    odometry: OdometrySheet = OdometrySheet()
    imu: ImuSheet = ImuSheet()
    magnetometer: MagnetometerSheet = MagnetometerSheet()
    drive: DriveSheet = DriveSheet()
    fence: FenceLimits = FenceLimits()
    lane_pursuit: LanePursuit = LanePursuit()
    tracking: TrackingGains = TrackingGains()
    team: TeamLimits = TeamLimits()
    move_off: MoveOffLimits = MoveOffLimits()
    link_timeout_s: Seconds = 2.0
    """Wall-clock seconds without operator and planner after which the robot stops by itself."""

    later_fields = ("camera", "odometry", "lane_pursuit", "tracking", "team", "move_off")
