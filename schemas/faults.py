"""Faults: what may go wrong with the robot, when and for how long.

Each kind is a class here, with its fields and their ranges, a function in services/robot_sim/fault_effects that applies
it, and a row of `FAULTS` that brings both together (`touchline.shipped_plugins`); those of other packages have theirs.

A scenario carries a timeline of them (`Scenario.faults`); `simulation/inject_fault` adds one to a running session. A
fault acts from `start_s` until `start_s + duration_s`; without a duration it lasts. When it ends, whatever it touched
is as it would have been without it, as far as the world allows: the robot stays where it was driven to, paint stays on
the grass, a receiver has to converge anew.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializeAsAny,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from touchline.schemas.plugins import FAULTS, SENSORS, UnknownPlugin, part_for
from touchline.schemas.spec import Spec, parse


class _SensorName:
    """Annotation of a text: the name of one of `SENSORS`."""

    def __get_pydantic_core_schema__(self, _source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(_known_sensor, handler(str))

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": list(SENSORS.names()), "type": "string"}


def _known_sensor(given: Any) -> str:
    if not isinstance(given, str) or not SENSORS.has(given):
        raise PydanticKnownError("literal_error", {"expected": SENSORS.listed})
    return given


Sensor = Annotated[str, _SensorName()]
Share = Annotated[float, Field(ge=0, le=1)]
ALL = "all"
"""Instead of an actuator's name."""
_Actuator = Annotated[str, Field(min_length=1, max_length=100)]

#: Sim time is counted in ticks; a hundred days are more than any session.
_Time = Annotated[float, Field(ge=0, le=8.64e6)]
_Duration = Annotated[float, Field(ge=0.01, le=8.64e6)]
_Delay = Annotated[float, Field(ge=0, le=5)]
_Offset = Annotated[float, Field(ge=-100, le=100)]


class Fault(Spec):
    """Base of the faults: what every one has. A kind is a row of `FAULTS`.

    Each kind adds the field `kind`, a `Literal` of its name, and its parameters.
    """

    if TYPE_CHECKING:
        kind: str

    start_s: _Time = 0.0
    """Sim time at which it begins [s]; in the live command, counted from the command."""
    duration_s: _Duration | None = None
    """How long it lasts [s], at least a tick; without it, to the end."""

    @property
    def summary(self) -> str:
        """One line for a person, without the parameters."""
        return FAULTS.summary(self.kind)


class GnssOutage(Fault):
    """The receiver has no position (antenna cable, jamming); afterwards it reacquires and converges."""

    kind: Literal["gnss-outage"]


class GnssDegraded(Fault):
    """The solution is no better than `fix`; with `claimed_m` the receiver is over-confident about it."""

    kind: Literal["gnss-degraded"]
    fix: Literal["single", "float"] = "float"
    claimed_m: Annotated[float, Field(ge=0.001, le=100)] | None = None
    """Reported 1 σ per axis [m]; by default what the scenario's receiver would report."""


class CorrectionsLost(Fault):
    """No RTK corrections arrive: the fix is held and drifts, then the solution jumps by metres."""

    kind: Literal["corrections-lost"]


class GnssWrongFix(Fault):
    """A wrong fix: reported as fixed and accurate, and off by this much."""

    kind: Literal["gnss-wrong-fix"]
    east_m: _Offset = 0.3
    north_m: _Offset = 0.0


class GnssNoisy(Fault):
    """Interference: the white noise of the positions grows, the reported variance does (`honest`) or does not."""

    kind: Literal["gnss-noisy"]
    white_m: Annotated[float, Field(gt=0, le=100)] = 0.05
    honest: bool = True


class CameraOutage(Fault):
    """The camera overhead does not find the robot: somebody stands in the way, the light is off."""

    kind: Literal["camera-outage"]


class MessagesLate(Fault):
    """Every message of a sensor comes this much later."""

    kind: Literal["messages-late"]
    sensor: Sensor
    delay_s: Annotated[float, Field(gt=0, le=5)]


class MessagesDuplicated(Fault):
    """Messages come a second time, `after_s` later."""

    kind: Literal["messages-duplicated"]
    sensor: Sensor
    after_s: _Delay = 0.0
    share: Share = 1.0


class MessagesReordered(Fault):
    """Every message takes a random extra time up to `spread_s`, so that they overtake each other."""

    kind: Literal["messages-reordered"]
    sensor: Sensor
    spread_s: Annotated[float, Field(gt=0, le=5)] = 0.25


class MessagesLost(Fault):
    """This share of a sensor's messages never comes."""

    kind: Literal["messages-lost"]
    sensor: Sensor
    share: Share = 1.0


class ClockSkew(Fault):
    """The receiver's clock is off against the robot's: its stamps are wrong by an offset and a drift."""

    kind: Literal["clock-skew"]
    offset_s: Annotated[float, Field(ge=-5, le=5)] = 0.05
    drift_ppm: Annotated[float, Field(ge=-10000, le=10000)] = 0.0


class ImuBias(Fault):
    """The yaw gyro and the forward accelerometer jump by a bias."""

    kind: Literal["imu-bias"]
    gyro_radps: Annotated[float, Field(ge=-1, le=1)] = 0.02
    accel_mps2: Annotated[float, Field(ge=-10, le=10)] = 0.0


class ImuNoisy(Fault):
    """Vibration: additional white noise on every axis of the IMU, per sample (1 σ)."""

    kind: Literal["imu-noisy"]
    gyro_radps: Annotated[float, Field(ge=0, le=10)] = 0.05
    accel_mps2: Annotated[float, Field(ge=0, le=100)] = 1.0


class ImuStuck(Fault):
    """The IMU goes on sending its last reading."""

    kind: Literal["imu-stuck"]


class MagneticDisturbance(Fault):
    """A field on top of the earth's, in the map frame: a parked car, a reinforced ditch cover."""

    kind: Literal["magnetic-disturbance"]
    east_t: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 10e-6
    north_t: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 0.0


class ActuatorFault(Fault):
    """Base of the faults of one of the drive's actuators, by its name, or of all of them."""

    actuator: _Actuator = ALL

    @model_validator(mode="before")
    @classmethod
    def _former_wheel(cls, given: Any) -> Any:
        """Formerly all vehicles had two wheels: the `wheel` was left, right or both."""
        if not isinstance(given, dict) or "wheel" not in given or "actuator" in given:
            return given
        rest = {name: value for name, value in given.items() if name != "wheel"}
        return rest | {"actuator": ALL if given["wheel"] == "both" else given["wheel"]}


class EncoderDropout(ActuatorFault):
    """An actuator's encoder counts nothing; what it missed stays missed."""

    kind: Literal["encoder-dropout"]


class WheelBlocked(ActuatorFault):
    """A wheel is held fast."""

    kind: Literal["wheel-blocked"]
    actuator: _Actuator = "left"


class WheelSlip(ActuatorFault):
    """A wheel loses this share of its ground speed, on top of what it loses anyway: mud, a wet line."""

    kind: Literal["wheel-slip"]
    share: Annotated[float, Field(ge=-0.5, le=0.95)] = 0.2


class MotorWeak(ActuatorFault):
    """A motor has only this share of its torque."""

    kind: Literal["motor-weak"]
    actuator: _Actuator = "left"
    share: Share = 0.2


class SteeringOffset(ActuatorFault):
    """A steered wheel is off its encoder's angle by this much, to the left: a blow has bent its linkage.

    Of wheels that do not steer nothing changes.
    """

    kind: Literal["steering-offset"]
    offset_rad: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.035


class ValveStuck(Fault):
    """The paint valve stays where it is told not to be."""

    kind: Literal["valve-stuck"]
    position: Literal["open", "closed"]


class DiscStuck(Fault):
    """The paint discs stay up or down."""

    kind: Literal["disc-stuck"]
    position: Literal["up", "down"]


class NozzleClogged(Fault):
    """Only this share of the paint gets through."""

    kind: Literal["nozzle-clogged"]
    share: Share = 0.3


class Bumper(Fault):
    """The bumper is pressed."""

    kind: Literal["bumper"]


class BatteryLow(Fault):
    """The battery gives no more than this share of its charge, until it is replaced: at the end, or by an order."""

    kind: Literal["battery-low"]
    fraction: Share = 0.05


class TankEmpty(Fault):
    """The tank gives no more than this much paint, until it is refilled: at the end, or by an order."""

    kind: Literal["tank-empty"]
    litres: Annotated[float, Field(ge=0, le=1000)] = 0.0


class OperatorLost(Fault):
    """Nobody who could stop the robot can be heard, in sim time."""

    kind: Literal["operator-lost"]


class _OfItsKind:
    """Annotation of a fault: it is read as the kind that it names has it."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_wrap_validator_function(_of_its_kind, handler(source))

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        kinds = [handler(model.__pydantic_core_schema__) for model in fault_models().values()]
        return {"discriminator": {"propertyName": "kind"}, "oneOf": kinds}


AnyFault = Annotated[SerializeAsAny[Fault], _OfItsKind()]
"""A fault of one of the kinds that are registered in `FAULTS`."""


def _of_its_kind(given: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    """The fault, as the kind that it names has it; what is wrong is told as of a tagged union."""
    if isinstance(given, Fault):
        return handler(given)
    if not isinstance(given, dict):
        raise PydanticKnownError("model_attributes_type")
    if "kind" not in given:
        raise PydanticKnownError("union_tag_not_found", {"discriminator": "'kind'"})
    try:
        model = part_for(FAULTS, str(given["kind"]), "spec", "fault")
    except UnknownPlugin as error:
        names = ", ".join(map(repr, FAULTS.names()))
        context = {"discriminator": "'kind'", "tag": error.name, "expected_tags": names}
        raise PydanticKnownError("union_tag_invalid", context) from error
    return model.model_validate(given, context=info.context)


def fault_models() -> dict[str, type[Fault]]:
    """The class of every kind that is registered, by the kind."""
    return {kind: part_for(FAULTS, kind, "spec", "fault") for kind in FAULTS.names()}


class _One(Spec):
    fault: AnyFault


def parse_fault(text: str, source: str = "fault") -> Fault:
    """The fault written as one JSON object in `text`.

    Raises:
        SpecError: It is not JSON, its kind is unknown, or a field is missing, unknown or out of range.
    """
    return parse(_One, f'{{"fault": {text}}}', source).fault


def describe(fault: Fault) -> str:
    """One line for a person: what it is, and its parameters."""
    details = ", ".join(
        f"{name} {value}"
        for name, value in fault.model_dump(exclude={"kind", "start_s", "duration_s"}).items()
        if value is not None
    )
    return f"{fault.summary} ({details})" if details else fault.summary
