"""Scenarios: everything that decides what an emulated session will be, to the bit."""

from typing import Annotated, Literal, Self

from pydantic import Field

from schemas.faults import Fault
from schemas.spec import Spec
from schemas.vehicle import NotNegative, Positive


class GnssNoise(Spec):
    """RTK-fixed GNSS: white noise plus two Gauss-Markov terms, per horizontal axis (1 σ).

    The defaults reproduce the 68/95/99.7 % quantiles of 4.6/6.8/11 mm published for moving ZED-F9P receivers.
    """

    white_m: NotNegative = 0.005
    gauss_markov_1_m: NotNegative = 0.005
    gauss_markov_1_tau_s: Positive = 115.0
    gauss_markov_2_m: NotNegative = 0.005
    gauss_markov_2_tau_s: Positive = 900.0
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.11


class ImuNoise(Spec):
    """Gyroscope and accelerometer: densities, turn-on bias (1 σ) and bias walk."""

    gyro_density_radps_rthz: NotNegative = 0.000244
    gyro_turn_on_bias_radps: NotNegative = 0.01745
    gyro_bias_walk_radps_rts: NotNegative = 0.00001
    accel_density_mps2_rthz: NotNegative = 0.001716
    accel_turn_on_bias_mps2: NotNegative = 0.196
    accel_bias_walk_mps2_rts: NotNegative = 0.0002


class MagnetometerNoise(Spec):
    """Magnetometer: white noise, a constant heading bias and a slowly wandering disturbance (1 σ, as heading)."""

    white_rad: NotNegative = 0.01
    bias_rad: NotNegative = 0.04
    disturbance_rad: NotNegative = 0.04
    disturbance_tau_s: Positive = 20.0


class DriveNoise(Spec):
    """How far the real wheels are from the nominal ones (1 σ) and how much they slip on grass."""

    wheel_radius_relative: NotNegative = 0.003
    track_width_relative: NotNegative = 0.002
    slip_relative: NotNegative = 0.02
    slip_tau_s: Positive = 0.5


class Ground(Spec):
    """What the robot drives on: one surface, one slope."""

    surface: Literal["grass", "wet-grass", "artificial-turf"] = "grass"
    grade: Annotated[float, Field(ge=0, le=0.15)] = 0.0
    """Rise over run; 0.02 is 2 %."""
    uphill_rad: Annotated[float, Field(ge=-7, le=7)] = 0.0
    """Direction of the rise in the map frame: 0 east, π/2 north."""


class EncoderNoise(Spec):
    """Wheel encoders: quantised to whole ticks or not at all."""

    quantised: bool = True


class Pose2(Spec):
    """Position (m) and heading (rad) in the map frame."""

    x_m: float
    y_m: float
    heading_rad: float


class Origin(Spec):
    """WGS 84 position of the map frame's origin: degrees, metres above the ellipsoid."""

    latitude_deg: Annotated[float, Field(ge=-89, le=89)] = 57.0124
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] = 9.9915
    altitude_m: Annotated[float, Field(ge=-500, le=9000)] = 20.0


class Scenario(Spec):
    """One emulated session."""

    name: str = "default"
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    follower: Literal["mpc", "pure-pursuit", "external"] = "mpc"
    noise: Literal["default", "none"] = "default"
    gnss: GnssNoise = GnssNoise()
    imu: ImuNoise = ImuNoise()
    magnetometer: MagnetometerNoise = MagnetometerNoise()
    drive: DriveNoise = DriveNoise()
    encoder: EncoderNoise = EncoderNoise()
    ground: Ground = Ground()
    start: Pose2 | None = None
    """Where the robot stands at first; by default at the start of the plan."""
    origin: Origin = Origin()
    faults: Annotated[tuple[Fault, ...], Field(max_length=1000)] = ()
    """What goes wrong when, in sim time; see `schemas.faults`."""
    link_timeout_s: Positive = 2.0
    """Wall-clock seconds without operator and planner after which the robot stops by itself."""

    def effective(self) -> Self:
        """This scenario with every noise figure at zero if ``noise`` is ``none``; latencies and faults stay."""
        if self.noise == "default":
            return self
        return self.model_copy(
            update={
                "gnss": GnssNoise(white_m=0, gauss_markov_1_m=0, gauss_markov_2_m=0, latency_s=self.gnss.latency_s),
                "imu": ImuNoise(**dict.fromkeys(ImuNoise.model_fields, 0.0)),
                "magnetometer": MagnetometerNoise(white_rad=0, bias_rad=0, disturbance_rad=0),
                "drive": DriveNoise(wheel_radius_relative=0, track_width_relative=0, slip_relative=0),
                "encoder": EncoderNoise(quantised=False),
            }
        )
