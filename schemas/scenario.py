"""Scenarios: the emulated world of a session, reproducible to the bit."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializeAsAny, WrapValidator, model_validator

from touchline.schemas.docks import DockSpec
from touchline.schemas.faults import AnyFault, Share
from touchline.schemas.given_angles import Angle
from touchline.schemas.kinds import of_its_kind
from touchline.schemas.overhead_cameras import Hiding, OverheadCamera
from touchline.schemas.plugins import SENSORS
from touchline.schemas.scenario_objects import ScenarioObject
from touchline.schemas.sensor_truth import SensorTruth
from touchline.schemas.spec import GrownSpec, Spec
from touchline.schemas.truth import Truth

Noise = Literal["default", "none"]
SurfaceName = Literal["grass", "wet-grass", "artificial-turf", "clay", "floor"]
Roughness = Literal["none", "A", "B", "C", "D"]
MAX_SEED = 2**63 - 1
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Coordinate = Annotated[float, Field(ge=-10000, le=10000)]


_Point = tuple[Coordinate, Coordinate]
_Sensor = Annotated[SerializeAsAny[SensorTruth], WrapValidator(of_its_kind(SENSORS, "truth"))]


OF_THE_COMPUTER = frozenset(("follower", "fence", "link_timeout_s"))
"""Fields that scenarios had before the robot's own computer had a configuration of its own."""


class GnssNoise(GrownSpec):
    """The RTK-GNSS receiver: errors per horizontal axis (1 σ; vertical ones are twice as large), delays, habits.

    Fixed: white noise and a slow Gauss-Markov term, fitted to a log of a standing ZED-F9P, and bursts while the antenna
    moves, with which the horizontal errors have the quantiles of a published test of 12,510 moving fixes: 7/17/38 mm
    (68/95/99.7 %).
    """

    white_m: NotNegative = 0.0007
    """White part of a fix's error, 1 σ an axis (log of a standing F9P)."""
    gauss_markov_1_m: NotNegative = 0.0043
    """Slow wander, 1 σ an axis (same log)."""
    gauss_markov_1_tau_s: Positive = 300.0
    """Correlation time of that wander (same log)."""
    gauss_markov_2_m: NotNegative = 0.0
    """A second wander, 1 σ an axis."""
    gauss_markov_2_tau_s: Positive = 900.0
    """Correlation time of the second wander."""
    rate_hz: Literal[1, 2, 5, 10, 20] = 10
    """Fixes per second."""
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.11
    """Delay of every fix, rounded up to ticks of 10 ms (110–120 ms)."""
    latency_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.01
    """Largest further delay, in whole ticks that are equally likely."""
    float_m: NotNegative = 0.3
    """Error of a float solution, 1 σ (typical)."""
    float_tau_s: Positive = 60.0
    """Correlation time of that error."""
    float_overconfident_share: Share = 0.2
    """Share of the float spells that claim `float_claimed_m` (assumed)."""
    float_claimed_m: Positive = 0.02
    """Accuracy that such a spell claims."""
    single_m: NotNegative = 1.3
    """Error of a single solution, 1 σ an axis (data sheet)."""
    single_tau_s: Positive = 60.0
    """Correlation time of that error."""
    hold_s: NotNegative = 60.0
    """Time for which a fix is held without corrections."""
    hold_drift_mps: NotNegative = 0.0005
    """Drift of a held fix (3 cm/min)."""
    reacquire_s: NotNegative = 2.0
    """Time from signals to the first position (data sheet)."""
    float_after_s: NotNegative = 1.0
    """Time from the first position to a float solution (assumed)."""
    converge_min_s: NotNegative = 2.0
    """Shortest time from float to fixed, drawn evenly."""
    converge_max_s: NotNegative = 6.5
    """Longest time from float to fixed (less than 10 s in all)."""
    burst_share: Annotated[float, Field(ge=0, le=0.9)] = 0.091
    """Share of the time of a moving antenna in bursts of correlated errors (12,510 moving ZED-F9P fixes)."""
    burst_m: NotNegative = 0.0137
    """Error in a burst, 1 σ an axis (same test)."""
    burst_s: Positive = 3.0
    """Mean length of a burst (assumed within 1 to 10 s)."""
    burst_tau_s: Positive = 1.0
    """Correlation time in a burst (two solvers' differences of an F9P that moves: about 1 s)."""

    later_fields = ("burst_m", "burst_s", "burst_tau_s")

    @classmethod
    def white_tail(cls) -> Self:
        """Errors as they were emulated before there were bursts: the same quantiles, each fix's tail for itself."""
        return cls(
            white_m=0.00471,
            gauss_markov_1_m=0.0025,
            gauss_markov_1_tau_s=115.0,
            gauss_markov_2_m=0.0025,
            burst_share=0.0,
        )

    @model_validator(mode="before")
    @classmethod
    def _of_older_recordings(cls, given: Any) -> Any:
        """Recordings from before there were bursts have every other field, and were made without."""
        if isinstance(given, dict) and given.keys() >= _BEFORE_BURSTS and "burst_share" not in given:
            return {**given, "burst_share": 0.0}
        return given

    @model_validator(mode="after")
    def _range_is_one(self) -> Self:
        if self.converge_max_s < self.converge_min_s:
            raise ValueError("converge_max_s must be at least converge_min_s")
        return self


_BEFORE_BURSTS = {name for name in GnssNoise.model_fields if not name.startswith("burst_")}


class CameraNoise(GrownSpec):
    """The camera overhead that sees the robot: errors of a pose (1 σ an axis; of the heading), delays, misses.

    A study of a network of small robots names such cameras and no figures; these are assumed.
    """

    white_m: NotNegative = 0.01
    """Error of a pose's position, 1 σ an axis (assumed)."""
    white_rad: NotNegative = 0.01745
    """Error of a pose's heading, 1 σ: 1° (assumed)."""
    rate_hz: Annotated[int, Field(ge=1, le=100)] = 15
    """Pictures per second."""
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.08
    """Delay of every pose."""
    latency_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.02
    """Largest further delay, in whole ticks that are equally likely."""
    dropout_share: Share = 0.02
    """Share of the pictures in which the robot is not found."""
    cameras: Annotated[tuple[OverheadCamera, ...], Field(max_length=100)] = ()
    """Several cameras, each with its view; none: one that sees all the ground."""
    hiding: Annotated[tuple[Hiding, ...], Field(max_length=1000)] = ()
    """Walls, people and the like that hide robots from them."""
    tag_height_m: Annotated[float, Field(ge=0, le=10)] = 0.4
    """Height of a robot's tag above the ground."""

    later_fields = ("cameras", "hiding", "tag_height_m")


class Obstruction(Spec):
    """Trees, a stand, a roof: within its outline the solution is no better than ``best_fix``."""

    name: str = ""
    """Name for people."""
    outline: Annotated[tuple[_Point, ...], Field(min_length=3, max_length=100)]
    """Corners of a polygon in the map frame."""
    best_fix: Literal["none", "single", "float", "fixed"] = "float"
    """Best solution inside."""
    margin_m: Annotated[float, Field(ge=0, le=100)] = 3.0
    """Distance outside the outline at which a part of the sky is still hidden."""
    noise_factor: Annotated[float, Field(ge=1, le=100)] = 2.0
    """White noise at the outline, relative to that in the open (assumed)."""


class Multipath(Spec):
    """Stand, fence, parked lorry: reflections bend the fixes near it, alike on each pass and slowly otherwise."""

    name: str = ""
    """Name for people."""
    outline: Annotated[tuple[_Point, ...], Field(min_length=3, max_length=100)]
    """Corners of a polygon in the map frame."""
    margin_m: Annotated[float, Field(ge=0, le=100)] = 3.0
    """Distance outside the outline over which the error falls to nothing (assumed)."""
    error_m: Annotated[float, Field(ge=0, le=1)] = 0.02
    """Error inside, 1 σ an axis (assumed within 10 to 30 mm; carrier phase at most 48 mm a satellite)."""
    length_m: Annotated[float, Field(ge=0.1, le=100)] = 3.0
    """Distance at which the error is correlated by 0.61 (assumed within 2 to 5 m)."""
    drift_s: Annotated[float, Field(ge=1, le=100_000)] = 1200.0
    """Time after which the error at a place is correlated by 0.61 (assumed: 0.88 after 10 minutes)."""


class Steel(Spec):
    """Steel in or on the ground: a field towards it that falls with the third power of the distance."""

    name: str = ""
    """Name for people."""
    outline: Annotated[tuple[_Point, ...], Field(min_length=1, max_length=100)]
    """A point, or the corners of a polygon, in the map frame."""
    field_t: Annotated[float, Field(gt=0, le=1e-3)] = 10e-6
    """Horizontal field at the outline and inside it."""
    reach_m: Annotated[float, Field(gt=0, le=100)] = 2.0
    """Distance at which an eighth of the field remains (assumed)."""


class ImuNoise(Spec):
    """Gyroscope and accelerometer: densities, turn-on bias (1 σ), bias walk, and drift with temperature (1 σ)."""

    gyro_density_radps_rthz: NotNegative = 0.000244
    """Noise density of the gyro, rad/s/√Hz (data sheet)."""
    gyro_turn_on_bias_radps: NotNegative = 0.01745
    """Gyro's bias at switch-on, 1 σ: 1 °/s (data sheet)."""
    gyro_bias_walk_radps_rts: NotNegative = 0.00001
    """Random walk of the gyro's bias, rad/s/√s (assumed)."""
    gyro_temperature_radps_per_k: NotNegative = 0.00009
    """Drift of the gyro's bias, 1 σ per K: 0.005 °/s/K."""
    accel_density_mps2_rthz: NotNegative = 0.001716
    """Noise density of the accelerometer, m/s²/√Hz (data sheet)."""
    accel_turn_on_bias_mps2: NotNegative = 0.196
    """Accelerometer's bias at switch-on, 1 σ: 20 mg (data sheet)."""
    accel_bias_walk_mps2_rts: NotNegative = 0.0002
    """Random walk of the accelerometer's bias, m/s²/√s (assumed)."""
    accel_temperature_mps2_per_k: NotNegative = 0.002
    """Drift of the accelerometer's bias, 1 σ per K (data sheet)."""
    warming_k: NotNegative = 15.0
    """Temperature rise after switch-on, K (assumed)."""
    warming_tau_s: Positive = 600.0
    """Time constant of that rise (assumed)."""


class MagnetometerNoise(Spec):
    """Magnetometer: white noise, hard iron, soft iron and a slowly wandering disturbance (1 σ, as heading).

    ``bias_rad`` is the hard iron; ``soft_iron_relative`` is how far gains and cross-gains are from 1 and 0.
    """

    white_rad: NotNegative = 0.01
    """White noise, 1 σ as heading."""
    bias_rad: NotNegative = 0.04
    """Hard iron, 1 σ an axis, as heading."""
    soft_iron_relative: Annotated[float, Field(ge=0, le=0.3)] = 0.02
    """Error of gains and cross-gains, 1 σ (assumed)."""
    disturbance_rad: NotNegative = 0.04
    """Slow disturbance by the surroundings, 1 σ as heading."""
    disturbance_tau_s: Positive = 20.0
    """Correlation time of the disturbance."""


class DriveNoise(GrownSpec):
    """Errors of the real wheels and steering (1 σ), and slip on grass."""

    wheel_radius_relative: NotNegative = 0.003
    """Error of each wheel's radius per seed, 1 σ as a share (assumed)."""
    track_width_relative: NotNegative = 0.002
    """Error of the track width per seed, 1 σ as a share (assumed)."""
    slip_relative: NotNegative = 0.02
    """Random slip of the wheels, 1 σ as a share (2–5 % seen on grass)."""
    slip_tau_s: Positive = 0.5
    """Correlation time of the random slip."""
    steering_offset_rad: NotNegative = 0.0175
    """Error of a steered wheel's straight-ahead angle per seed, 1 σ: 1° (assumed).

    Written only if it is another figure. Scenarios of robots that steer with their wheels' speeds, and their hashes,
    are thus what they were before.
    """

    later_fields = ("steering_offset_rad",)


class GroundWave(Spec):
    """Crown or ruts of the ground: parallel crests and troughs, a sine across them (assumed).

    A crown has its crest along the middle of the pitch, and twice the pitch's width between two crests; ruts are a
    track apart. The robot leans with them; wheels are not guided by them.
    """

    rise_m: Annotated[float, Field(gt=0, le=5)]
    """Height of the crests above the troughs; a pitch that falls by 1 % on average has a crest of that times its
    width."""
    length_m: Annotated[float, Field(ge=0.2, le=10_000)]
    """Distance between two crests."""
    across_rad: Angle = 0.0
    """Direction across the crests in the map frame."""
    crest_x_m: Coordinate = 0.0
    """A point on a crest, east."""
    crest_y_m: Coordinate = 0.0
    """The same, north."""


class Ground(GrownSpec):
    """Ground that the robot drives on: one surface, one slope, one roughness, and waves."""

    surface: SurfaceName = "grass"
    """Surface; by default that of the shipped vehicle."""
    grade: Annotated[float, Field(ge=0, le=0.15)] = 0.0
    """Rise over run: 0.02 is 2 %."""
    uphill_rad: Angle = 0.0
    """Direction of the rise in the map frame: 0 east, π/2 north."""
    roughness: Roughness = "none"
    """Class of ISO 8608, by the geometric mean of its heights' spectrum; lawn is B to C (assumed)."""
    roughness_factor: Annotated[float, Field(gt=0, le=10)] = 1.0
    """Heights relative to those of the class."""
    waves: Annotated[tuple[GroundWave, ...], Field(max_length=20)] = ()
    """Crown and ruts."""

    later_fields = ("roughness", "roughness_factor", "waves")


class EncoderNoise(Spec):
    """Wheel encoders: quantised to whole ticks or not at all."""

    quantised: bool = True
    """Encoders count whole ticks (1024 × 4 on the motor shaft)."""


class Pose2(Spec):
    """Position (m) and heading (rad) in the map frame."""

    x_m: Coordinate
    """East."""
    y_m: Coordinate
    """North."""
    heading_rad: Angle
    """Heading, counter-clockwise from east."""


class Origin(Spec):
    """WGS 84 position of the map frame's origin: degrees, metres above the ellipsoid."""

    latitude_deg: Annotated[float, Field(ge=-89, le=89)] = 57.0124
    """Latitude (WGS 84); the default is a pitch in northern Denmark."""
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] = 9.9915
    """Longitude."""
    altitude_m: Annotated[float, Field(ge=-500, le=9000)] = 20.0
    """Height above the ellipsoid."""


class Scenario(GrownSpec):
    """The world of one emulated session, the errors of the robot's sensors and drives included.

    The robot's own computer knows nothing of it: see `touchline.schemas.onboard`.
    """

    name: str = "default"
    """Name for people."""
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 1
    """Seed of all randomness."""
    noise: Noise = "default"
    """`none` sets all noise figures to zero; latency, ground, places, truth and faults stay."""
    gnss: GnssNoise = GnssNoise()
    camera: CameraNoise = CameraNoise()
    """Of robots that have one overhead; written only if it is another one, as scenarios were before there was any."""
    imu: ImuNoise = ImuNoise()
    magnetometer: MagnetometerNoise = MagnetometerNoise()
    drive: DriveNoise = DriveNoise()
    encoder: EncoderNoise = EncoderNoise()
    ground: Ground = Ground()
    sky: Annotated[tuple[Obstruction, ...], Field(max_length=100)] = ()
    """Obstructions that hide the sky from the GNSS antenna."""
    steel: Annotated[tuple[Steel, ...], Field(max_length=100)] = ()
    """Steel that disturbs the magnetometer."""
    multipath: Annotated[tuple[Multipath, ...], Field(max_length=100)] = ()
    """Places whose reflections bend the fixes."""
    truth: Truth = Truth()
    start: Pose2 | None = None
    """Pose at first; null: where the plan begins."""
    origin: Origin = Origin()
    faults: Annotated[tuple[AnyFault, ...], Field(max_length=1000)] = ()
    """Timeline of faults."""

    sensors: Annotated[tuple[_Sensor, ...], Field(max_length=20)] = ()
    """Auxiliary sensors, by their kinds; a kind that is not here is as by default."""
    objects: Annotated[tuple[ScenarioObject, ...], Field(max_length=1000)] = ()
    """Things, people and animals in the robot's way or beside it."""
    docks: Annotated[tuple[DockSpec, ...], Field(max_length=1000)] = ()
    """Docks, each of which charges the battery while the robot stands at it."""
    charge: Share = 1.0
    """Charge of the battery at the start, a share of the whole."""

    later_fields = ("camera", "sensors", "objects", "multipath", "truth", "docks", "charge")

    @model_validator(mode="before")
    @classmethod
    def _is_of_the_world(cls, given: Any) -> Any:
        for name in sorted(OF_THE_COMPUTER.intersection(given if isinstance(given, dict) else ())):
            raise ValueError(f"{name} is of the robot's own computer: move it to a file for --onboard")
        return given

    @classmethod
    def reality(cls) -> Self:
        """Ground and body as logs of robots on grass have them: rough ground, a course that wanders, vibration.

        Not the default: figures of accuracy are without. The receiver is as by default.
        """
        return cls(
            name="reality",
            ground=Ground(roughness="C"),
            truth=Truth(wander_rad=0.02, vibration_mps2=0.4),
        )

    def at(self, origin: Origin | None) -> Self:
        """This scenario with the map frame's origin at ``origin``; unchanged if that is None."""
        return self if origin is None else self.model_copy(update={"origin": origin})

    def standing(self) -> Pose2:
        """Pose of a robot that has no plan yet: the start, or 0, 0, 0 if there is none."""
        return self.start or Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)

    def effective(self) -> Self:
        """This scenario with every noise figure at zero if ``noise`` is ``none``.

        Latency, ground, places, faults, and what the truth does not draw at random stay as they are.
        """
        if self.noise == "default":
            return self
        return self.model_copy(
            update={name: _silenced(getattr(self, name), figures) for name, figures in _NOISE_FIGURES.items()}
        )


_NOISE_FIGURES: dict[str, tuple[str, ...]] = {
    "gnss": ("white_m", "gauss_markov_1_m", "gauss_markov_2_m", "latency_jitter_s", "burst_share"),
    "camera": ("white_m", "white_rad", "latency_jitter_s", "dropout_share"),
    "imu": tuple(name for name in ImuNoise.model_fields if name != "warming_tau_s"),
    "magnetometer": ("white_rad", "bias_rad", "soft_iron_relative", "disturbance_rad"),
    "drive": ("wheel_radius_relative", "track_width_relative", "slip_relative", "steering_offset_rad"),
    "encoder": ("quantised",),
    "truth": ("stamp_jitter_s", "wander_rad", "vibration_mps2"),
}
"""Figures that ``noise: none`` sets to zero: those that make two runs in the same place differ."""


def _silenced(group: Spec, figures: tuple[str, ...]) -> Spec:
    return group.model_copy(update={name: type(getattr(group, name))(0) for name in figures})
