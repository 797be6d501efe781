"""Faults: failures of the robot or its surroundings, with their start and duration.

Each kind is a class here, with its fields and their ranges, a function in services/robot_sim/fault_effects that applies
it, and a row of `FAULTS` that joins both (`touchline.shipped_plugins`); other packages have modules of their own for
theirs.

A scenario carries a timeline of faults (`Scenario.faults`); `simulation/inject_fault` adds one to a running session. A
fault acts from `start_s` until `start_s + duration_s`; without a duration it lasts. When it ends, everything it
affected is as it would have been without it, as far as the world allows: the robot stays where it was driven to, paint
stays on the grass, a receiver has to converge anew.
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
    """Annotation of a string: the name of one of `SENSORS`."""

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
"""Stands for all actuators instead of the name of one."""
_Actuator = Annotated[str, Field(min_length=1, max_length=100)]

#: Sim time is counted in ticks; a hundred days are more than any session.
_Time = Annotated[float, Field(ge=0, le=8.64e6)]
_Duration = Annotated[float, Field(ge=0.01, le=8.64e6)]
_Delay = Annotated[float, Field(ge=0, le=5)]
_Offset = Annotated[float, Field(ge=-100, le=100)]


class Fault(Spec):
    """Base of the faults, with the common fields; a kind is a row of `FAULTS`.

    Each kind adds the field `kind`, a `Literal` of its name, and its parameters.
    """

    if TYPE_CHECKING:
        kind: str

    start_s: _Time = 0.0
    """Sim time of the start [s]; in the live command, counted from the command."""
    duration_s: _Duration | None = None
    """Duration [s], at least a tick; None: to the end."""

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
    """Reported 1 σ per axis [m]; None: the value that the scenario's receiver would report."""


class CorrectionsLost(Fault):
    """No RTK corrections arrive: the fix is held and drifts, then the solution jumps by metres."""

    kind: Literal["corrections-lost"]


class GnssWrongFix(Fault):
    """A wrong fix: reported as fixed and accurate, but wrong by this offset."""

    kind: Literal["gnss-wrong-fix"]
    east_m: _Offset = 0.3
    north_m: _Offset = 0.0


class GnssNoisy(Fault):
    """Interference: the white noise of the positions grows; the reported variance grows with it if `honest`."""

    kind: Literal["gnss-noisy"]
    white_m: Annotated[float, Field(gt=0, le=100)] = 0.05
    honest: bool = True


class CameraOutage(Fault):
    """The overhead camera does not find the robot: somebody stands in the way, the light is off."""

    kind: Literal["camera-outage"]


class CameraSwapped(Fault):
    """The overhead camera takes another robot for this one: its poses are off by where that is."""

    kind: Literal["camera-swapped"]
    east_m: _Offset = 0.5
    north_m: _Offset = 0.0
    turn_rad: Annotated[float, Field(ge=-4, le=4)] = 0.0


class LidarBlind(Fault):
    """No beam of any lidar has a return: dirt or water on its window. Its scans arrive as before."""

    kind: Literal["lidar-blind"]


class LidarFalseReturns(Fault):
    """This share of the beams of every lidar has a false return in each scan: heavy rain, dust, insects."""

    kind: Literal["lidar-false-returns"]
    share: Annotated[float, Field(ge=0, le=1)] = 0.005


class MessagesLate(Fault):
    """Every message of a sensor arrives later by `delay_s`."""

    kind: Literal["messages-late"]
    sensor: Sensor
    delay_s: Annotated[float, Field(gt=0, le=5)]


class MessagesDuplicated(Fault):
    """Messages arrive a second time, `after_s` later."""

    kind: Literal["messages-duplicated"]
    sensor: Sensor
    after_s: _Delay = 0.0
    share: Share = 1.0


class MessagesReordered(Fault):
    """Messages are delayed by random times up to `spread_s`, and so overtake each other."""

    kind: Literal["messages-reordered"]
    sensor: Sensor
    spread_s: Annotated[float, Field(gt=0, le=5)] = 0.25


class MessagesLost(Fault):
    """This share of a sensor's messages never arrives."""

    kind: Literal["messages-lost"]
    sensor: Sensor
    share: Share = 1.0


class ClockSkew(Fault):
    """The receiver's clock differs from the robot's: its stamps are wrong by an offset and a drift."""

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
    """The IMU continues to send its last reading."""

    kind: Literal["imu-stuck"]


class MagneticDisturbance(Fault):
    """A magnetic field in addition to the earth's, in the map frame: a parked car, a reinforced ditch cover."""

    kind: Literal["magnetic-disturbance"]
    east_t: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 10e-6
    north_t: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 0.0


class ActuatorFault(Fault):
    """Base of the faults of one of the drive's actuators, by its name, or of all of them."""

    actuator: _Actuator = ALL

    @model_validator(mode="before")
    @classmethod
    def _former_wheel(cls, given: Any) -> Any:
        """Accept the former `wheel`, from when all vehicles had two wheels: left, right or both."""
        if not isinstance(given, dict) or "wheel" not in given or "actuator" in given:
            return given
        rest = {name: value for name, value in given.items() if name != "wheel"}
        return rest | {"actuator": ALL if given["wheel"] == "both" else given["wheel"]}


class EncoderDropout(ActuatorFault):
    """An actuator's encoder counts nothing; the missed counts stay missed."""

    kind: Literal["encoder-dropout"]


class WheelBlocked(ActuatorFault):
    """A wheel is blocked."""

    kind: Literal["wheel-blocked"]
    actuator: _Actuator = "left"


class WheelSlip(ActuatorFault):
    """A wheel loses this share of its ground speed in addition to its usual slip: mud, a wet line."""

    kind: Literal["wheel-slip"]
    share: Annotated[float, Field(ge=-0.5, le=0.95)] = 0.2


class MotorWeak(ActuatorFault):
    """A motor has only this share of its torque."""

    kind: Literal["motor-weak"]
    actuator: _Actuator = "left"
    share: Share = 0.2


class SteeringOffset(ActuatorFault):
    """A steered wheel points further to the left than its encoder reads, by this offset: a blow has bent its linkage.

    Wheels that do not steer are not affected.
    """

    kind: Literal["steering-offset"]
    offset_rad: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.035


class ValveStuck(Fault):
    """The paint valve stays in this position, whatever is commanded."""

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
    """The battery gives no more than this share of its charge until replaced, at the fault's end or by an order."""

    kind: Literal["battery-low"]
    fraction: Share = 0.05


class TankEmpty(Fault):
    """The tank gives no more than this much paint until refilled, at the fault's end or by an order."""

    kind: Literal["tank-empty"]
    litres: Annotated[float, Field(ge=0, le=1000)] = 0.0


class OperatorLost(Fault):
    """No operator who could stop the robot is heard, in sim time."""

    kind: Literal["operator-lost"]


class _OfItsKind:
    """Annotation of a fault: it is parsed by the model of its kind."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_wrap_validator_function(_of_its_kind, handler(source))

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        kinds = [handler(model.__pydantic_core_schema__) for model in fault_models().values()]
        return {"discriminator": {"propertyName": "kind"}, "oneOf": kinds}


AnyFault = Annotated[SerializeAsAny[Fault], _OfItsKind()]
"""A fault of one of the kinds that are registered in `FAULTS`."""


def _of_its_kind(given: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    """Parse a fault by the model of its kind; errors are those of a tagged union."""
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
    """Return the model of every registered kind, by the kind."""
    return {kind: part_for(FAULTS, kind, "spec", "fault") for kind in FAULTS.names()}


class _One(Spec):
    fault: AnyFault


def parse_fault(text: str) -> Fault:
    """Parse a fault from one JSON object.

    Raises:
        SpecError: It is not JSON, its kind is unknown, or a field is missing, unknown or out of range.
    """
    return parse(_One, f'{{"fault": {text}}}', "fault").fault


def describe(fault: Fault) -> str:
    """Describe a fault in one line for people, with its parameters."""
    details = ", ".join(
        f"{name} {value}"
        for name, value in fault.model_dump(exclude={"kind", "start_s", "duration_s"}).items()
        if value is not None
    )
    return f"{fault.summary} ({details})" if details else fault.summary
