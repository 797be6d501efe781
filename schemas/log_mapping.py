"""Mapping of a foreign log to the robot's sensors: which stream and column is which, in which unit and frame.

All times are in seconds of the log's own clock, all angles counter-clockwise, and the body frame is that of REP-103.
"""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, field_validator, model_validator

from touchline.schemas.given_angles import Angle
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plain_text import plain
from touchline.schemas.scenario import Origin
from touchline.schemas.spec import Spec

StreamName = Annotated[str, Field(min_length=1, max_length=200)]
ColumnName = Annotated[str, Field(min_length=1, max_length=200)]
Offset = Annotated[float, Field(ge=-1e9, le=1e9)]
BodyAxis = Literal["x", "y", "z", "-x", "-y", "-z"]
FixKind = Literal["none", "single", "float", "fixed"]
FIX_KINDS: Final[tuple[FixKind, ...]] = ("none", "single", "float", "fixed")
"""In the order of `GnssStatus`."""


class ScaledColumn(Spec):
    """A column in another unit: its values are multiplied, then shifted."""

    column: ColumnName
    scale: Annotated[float, Field(ge=-1e12, le=1e12)] = 1.0
    offset: Offset = 0.0


Column = ColumnName | ScaledColumn
"""The name of a column in SI units (degrees for latitudes and longitudes), or one with scale and offset."""


class StreamSource(Spec):
    """Source of a sensor's readings."""

    stream: StreamName
    columns: Annotated[dict[str, Column], Field(max_length=50)] = Field(default_factory=dict)
    """By quantity; those that are not named are as the stream's type has them by default."""
    time_offset_s: Annotated[float, Field(ge=-86400, le=86400)] = 0.0
    """Added to its stamps."""


class FixSource(StreamSource):
    """Positions of the antenna."""

    taken_as: FixKind | None = None
    """The kind of all fixes that are any, whatever the log says of them."""
    sigma_m: Annotated[float, Field(gt=0, le=1000)] | None = None
    """Reported 1 σ an axis of all fixes, whatever the log says."""
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.1
    """Age of a fix when it arrives."""


class ImuSource(StreamSource):
    """Yaw rate and specific force."""

    axes: tuple[BodyAxis, BodyAxis, BodyAxis] = ("x", "y", "z")
    """Axes of the sensor that point forward, to the left and up."""
    accelerometer: bool = True
    """Use its accelerometer."""

    @field_validator("axes")
    @classmethod
    def _turns(cls, given: tuple[str, str, str]) -> tuple[str, str, str]:
        names = [axis[-1] for axis in given]
        if sorted(names) != ["x", "y", "z"]:
            raise ValueError("name each of x, y and z once")
        even = names in (["x", "y", "z"], ["y", "z", "x"], ["z", "x", "y"])
        negative = sum(axis.startswith("-") for axis in given)
        if even != (negative % 2 == 0):
            raise ValueError("these axes are left-handed: change the sign of one")
        return given


class WheelSource(StreamSource):
    """Odometry of the wheels."""

    standing_mps: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Slower than this it is noise, and the wheels stand."""
    unsigned: bool = False
    """They count forward even where the robot reverses, which is found by the course of the fixes."""


class HeadingSource(Spec):
    """The heading at the start; later the estimator has none to go by, as the magnetometer is left out."""

    start_rad: Angle | None = None
    """Counter-clockwise from east. By default it is the course over the first metres by the fixes, less that by the
    odometry."""
    course_m: Annotated[float, Field(gt=0, le=1000)] = 3.0
    """Metres that this takes."""


class TrackSource(StreamSource):
    """The track that another instrument measured, to compare the estimate with."""

    point: Literal["body", "antenna"] = "body"
    """Point of the robot whose track it is."""


class LogMapping(Spec):
    """A log as the sensors of one robot."""

    name: str = ""
    source: str = ""
    """Origin of the log, for people."""
    licence: str = ""
    vehicle: Annotated[str, Field(min_length=1, max_length=1000)] = "turf-tank-two"
    """A shipped robot, or a file beside the mapping's."""
    antenna_m: Annotated[tuple[float, float, float], Field()] | None = None
    """Lever arm of the antenna: forward, to the left, up. By default the vehicle's."""
    onboard: OnboardConfig = OnboardConfig()
    origin: Origin | None = None
    """Of the map frame; by default the first fix."""
    from_s: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """Time from the log's begin before which all is left out."""
    until_s: Annotated[float, Field(gt=0, le=1e9)] | None = None
    fixes: FixSource | None = None
    imu: ImuSource | None = None
    wheels: WheelSource | None = None
    heading: HeadingSource = HeadingSource()
    reference: TrackSource | None = None
    standing: bool = False
    """The antenna stood all the time, on a tripod: wheels and IMU that the log lacks are those of a robot at rest."""

    @field_validator("name", "source", "licence")
    @classmethod
    def _printable(cls, given: str) -> str:
        if plain(given, 500) != given:
            raise ValueError("use at most 500 printable characters")
        return given

    @field_validator("antenna_m")
    @classmethod
    def _on_the_robot(cls, given: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if given is not None and any(abs(value) > 10 for value in given):
            raise ValueError("give metres from the body's origin, each within ±10")
        return given

    @model_validator(mode="after")
    def _something_is_left(self) -> Self:
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError("until_s must be more than from_s")
        return self
