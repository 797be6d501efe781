"""Configuration of the robot's computer: sensor data sheets, follower and limits.

The defaults are the shipped robot's. None of it decides what is true: that is the scenario's, of which the robot's
computer sees nothing but what its sensors say.
"""

from datetime import date
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

    white_m: Deviation = 0.002
    """White part of a fix's error, 1 σ an axis."""
    gauss_markov_1_m: Deviation = 0.0043
    """Slow wander of a fix, 1 σ an axis."""
    gauss_markov_1_tau_s: Seconds = 300.0
    """Correlation time of that wander."""
    gauss_markov_2_m: Deviation = 0.0047
    """A second wander, 1 σ an axis: of a moving antenna's bursts."""
    gauss_markov_2_tau_s: Seconds = 2.0
    """Correlation time of the second wander."""
    rate_hz: Literal[1, 2, 5, 10, 20] = 10
    """Fixes per second."""
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.11
    """Age of a fix when it arrives."""
    latency_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.01
    """Largest addition to that age."""
    jump_fixes: Annotated[int, Field(ge=10, le=1000)] | None = None
    """Outlying fixes in a row after which a jump is accepted; null: only `resume` accepts one."""
    stamp_offset_s: Annotated[float, Field(ge=-0.2, le=0.2)] = 0.0
    """Time of a fix's measurement less its stamp, as `touchline calibrate` finds it."""
    stamp_offset_sigma_s: Annotated[float, Field(ge=0, le=0.1)] = 0.01
    """Uncertainty of that, 1 σ; 0: not to be estimated."""
    antenna_sigma_m: Annotated[float, Field(ge=0, le=0.1)] = 0.01
    """Uncertainty of the antenna's place in the body, 1 σ an axis (tape measure: 1 cm); 0: not to be estimated."""

    later_fields = ("jump_fixes", "stamp_offset_s", "stamp_offset_sigma_s", "antenna_sigma_m")


class CameraSheet(Spec):
    """The camera overhead: errors of a pose along an axis and of its heading (1 σ), rate and delay."""

    white_m: Deviation = 0.01
    """Error of a pose's position, 1 σ an axis."""
    white_rad: Deviation = 0.01745
    """Error of a pose's heading, 1 σ (1°)."""
    rate_hz: Annotated[int, Field(ge=1, le=100)] = 15
    """Poses per second."""
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.08
    """Age of a pose when it arrives."""
    latency_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.02
    """Largest addition to that age."""


class OdometrySheet(Spec):
    """Odometry alone: how well the start pose is known (1 σ an axis; heading), and what nothing can correct later."""

    start_sigma_m: Annotated[float, Field(ge=0.0001, le=100)] = 0.01
    """Uncertainty of the start position, 1 σ an axis."""
    start_sigma_rad: Annotated[float, Field(ge=0.0001, le=1)] = 0.01745
    """Uncertainty of the start heading, 1 σ (1°)."""
    scale_relative: Annotated[float, Field(ge=0, le=0.5)] = 0.005
    """Lasting error of all distances that the wheels count, 1 σ (radius, slip)."""
    max_sigma_m: Annotated[float, Field(gt=0, le=10_000)] | None = None
    """Position σ beyond which the robot does not drive; null: it always drives."""


class ImuSheet(GrownSpec):
    """Gyroscope and accelerometer: densities, bias walk, drift with temperature (1 σ), and how warm they get."""

    gyro_density_radps_rthz: Deviation = 0.000244
    """Noise density of the gyro, rad/s/√Hz (0.014 °/s/√Hz)."""
    gyro_bias_walk_radps_rts: Deviation = 0.00001
    """Random walk of the gyro's bias, rad/s/√s."""
    gyro_temperature_radps_per_k: Deviation = 0.00009
    """Drift of the gyro's bias with temperature, 1 σ per K."""
    accel_density_mps2_rthz: Deviation = 0.001716
    """Noise density of the accelerometer, m/s²/√Hz (175 µg/√Hz)."""
    accel_turn_on_bias_mps2: Deviation = 0.196
    """Accelerometer's bias at switch-on, 1 σ (20 mg)."""
    accel_bias_walk_mps2_rts: Deviation = 0.0002
    """Random walk of the accelerometer's bias, m/s²/√s."""
    accel_temperature_mps2_per_k: Deviation = 0.002
    """Drift of the accelerometer's bias with temperature, 1 σ per K."""
    warming_k: Deviation = 15.0
    """Temperature rise after switch-on, K."""
    warming_tau_s: Seconds = 600.0
    """Time constant of that rise."""
    gyro_scale_relative: Annotated[float, Field(ge=-0.1, le=0.1)] = 0.0
    """Share by which the gyro reads more than the true rate, as `touchline calibrate` finds it."""

    gyro_scale_sigma: Annotated[float, Field(ge=0, le=0.1)] = 0.005
    """Uncertainty of that, 1 σ as a share; 0: not to be estimated."""

    later_fields = ("gyro_scale_relative", "gyro_scale_sigma")


class MagnetometerSheet(Spec):
    """The magnetometer as built in: white noise, hard iron and disturbances of the surroundings (1 σ, as heading)."""

    white_rad: Deviation = 0.01
    """White noise, 1 σ as heading."""
    bias_rad: Deviation = 0.04
    """Hard iron, 1 σ an axis, as heading."""
    disturbance_rad: Deviation = 0.04
    """Disturbance by the surroundings, 1 σ as heading."""
    disturbance_tau_s: Seconds = 20.0
    """Correlation time of the disturbance."""


class DriveSheet(GrownSpec):
    """Slip of the wheels on the robot's usual ground, and errors of its track (1 σ)."""

    track_width_relative: Deviation = 0.002
    """Error of the vehicle's track width, 1 σ as a share."""
    slip_relative: Deviation = 0.02
    """Slip of the wheels on the robot's usual ground, 1 σ as a share."""
    slip_tau_s: Seconds = 0.5
    """Correlation time of the slip."""
    side_slip_m_rtm: Deviation = 0.01
    """Random walk sideways, 1 σ after a metre (logs of other robots: 0.02; the shipped marker: 0.004)."""
    grip: Annotated[float, Field(ge=0.05, le=2)] = 0.6
    """Largest braking force over the load on the driven wheels (dry grass 0.6, wet grass 0.35)."""

    crab_rad: Annotated[float, Field(ge=0, le=0.2)] = 0.015
    """Angle between the heading and the way that the robot takes, which no sensor tells, 1 σ (a mower: 0.02)."""

    later_fields = ("side_slip_m_rtm", "grip", "crab_rad")


class FenceLimits(Spec):
    """Distance and time for which any part of the body may be beyond the fence before the robot stops hard."""

    margin_m: Annotated[float, Field(ge=0, le=1000)] = 2.0
    """Allowed distance beyond the hull of what the body sweeps along the plan."""
    boundary_margin_m: Annotated[float, Field(ge=0, le=1000)] = 0.1
    """Allowed distance beyond a template's boundary, which then is the fence."""
    timeout_s: Annotated[float, Field(ge=0.01, le=10)] = 0.2
    """Sim time beyond it after which the robot stops."""


class LanePursuit(Spec):
    """Settings of the follower `pursuit-lanes`; the defaults are those of the study that it is from."""

    lookahead_m: Annotated[float, Field(gt=0, le=100)] = 5.0
    """Distance ahead along the path at which `pursuit-lanes` aims."""
    min_speed_mps: Annotated[float, Field(gt=0, le=10)] = 0.1
    """Speed at which a lane begins and ends."""
    max_speed_mps: Annotated[float, Field(gt=0, le=10)] = 1.0
    """Highest speed, if the drive's is not lower."""
    acceleration_mps2: Annotated[float, Field(gt=0, le=10)] = 0.1
    """Acceleration and deceleration along a lane."""
    tolerance_m: Annotated[float, Field(ge=0, le=10)] = 0.2
    """Distance to a lane's end within which it rolls out, below `min_speed_mps` too."""
    steer_first: bool = False
    """Stand at the start of a lane until the steering is within 0.02 rad."""

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
    """Damping ζ of all trackers."""
    scale_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 10.0
    """Gain b of `linear-scaled` and `nonlinear`."""
    slow_mps: Annotated[float, Field(gt=0, le=1)] = 0.02
    """v_ε of `regularised`; below it `dynamic` counts as nearly at rest."""
    lateral_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 4.0
    """Gain k_a of `frenet`."""
    heading_1ps: Annotated[float, Field(gt=0, le=100)] = 4.0
    """Gain k_b of `frenet`."""


class MoveOffLimits(Spec):
    """Warnings before the robot moves off, and the longest stop that it ends by itself."""

    warning_s: Annotated[float, Field(ge=2, le=60)] = 2.0
    """Warning before the robot moves off after a pause, sim time."""
    start_warning_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    """Warning after a start, a goal or the begin of guidance, sim time.

    The emulated robot sets off at once: give a real machine at least 2 s.
    """
    person_after_s: Annotated[float, Field(gt=0, le=1_000_000)] | None = None
    """Longest stop that the robot ends by itself; null: 30 s with a tool or above 20 kg, else none."""


class TeamLimits(Spec):
    """Limits within which a robot keeps to the cells that a team's coordinator gives it."""

    lease_s: Annotated[float, Field(gt=0, le=60)] = 1.0
    """Time without an echo of its messages after which a guided robot brakes.

    The coordinator counts on that.
    """
    doubt_m: Annotated[float, Field(ge=0, le=1)] = 0.005
    """Distance by which it may believe itself outside a cell that it takes.

    It is part of the radius that is kept free.
    """
    there_m: Annotated[float, Field(gt=0, le=1)] = 0.01
    """Distance to the target at which it stops."""
    away_m: Annotated[float, Field(gt=0, le=1)] = 0.02
    """Distance of the target at which it sets off again."""

    @model_validator(mode="after")
    def _sets_off_farther_away(self) -> Self:
        if self.there_m > self.away_m:
            raise ValueError("there_m must be at most away_m")
        return self


class Calibrated(Spec):
    """Calibration that a constant's value and σ are from."""

    day: date
    """Day of the drive, as 2026-11-29."""
    log: Annotated[str, Field(max_length=255)] = ""
    """Name of its recording."""
    age_days: Annotated[float, Field(ge=0, le=100_000)] = 0.0
    """Days since then, with which σ grows; filled in when the file is read."""


class Calibrations(Spec):
    """Calibrations of the robot's constants, by the drive; null: as by tape measure and data sheet."""

    gyro_scale: Calibrated | None = None
    """Source of `imu.gyro_scale_relative` and `imu.gyro_scale_sigma`."""
    antenna: Calibrated | None = None
    """Source of the vehicle's `body.gnss_antenna_x_m` and `gnss_antenna_y_m`, and of `gnss.antenna_sigma_m`."""
    stamp_offset: Calibrated | None = None
    """Source of `gnss.stamp_offset_s` and `gnss.stamp_offset_sigma_s`."""
    track_width: Calibrated | None = None
    """Source of the vehicle's `drive.track_width_m`."""
    side_slip: Calibrated | None = None
    """Source of the vehicle's `drive.side_slip_rad_per_mps2`."""

    def on(self, day: date) -> Self:
        """Return them with their age on a day; none is younger than 0."""
        known = {name: value for name, value in self if value is not None}
        aged = {
            name: value.model_copy(update={"age_days": max(float((day - value.day).days), 0.0)})
            for name, value in known.items()
        }
        return self.model_copy(update=aged)


class OnboardConfig(GrownSpec):
    """The robot's own computer: what follows the path, what it is told of its sensors, when it stops by itself."""

    follower: Follower = FOLLOWERS.default
    """Name of the follower; `--follower` takes precedence."""
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
    calibrated: Calibrations = Calibrations()
    link_timeout_s: Seconds = 2.0
    """Wall clock without operator and planner after which the robot stops."""

    later_fields = ("camera", "odometry", "lane_pursuit", "tracking", "team", "move_off", "calibrated")

    def on(self, day: date) -> Self:
        """This configuration with the age of its calibrations on a day."""
        return self.model_copy(update={"calibrated": self.calibrated.on(day)})
