"""Faults: what may go wrong with the robot, when and for how long.

A scenario carries a timeline of them (`Scenario.faults`); `simulation/inject_fault` adds one to a running session. A
fault acts from `start_s` until `start_s + duration_s`; without a duration it lasts. When it ends, whatever it touched
is as it would have been without it, as far as the world allows: the robot stays where it was driven to, paint stays on
the grass, a receiver has to converge anew.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from touchline.schemas.spec import Spec, parse

Sensor = Literal["gnss", "imu", "magnetometer", "encoder", "camera"]
Share = Annotated[float, Field(ge=0, le=1)]
ALL = "all"
"""Instead of an actuator's name."""
_Actuator = Annotated[str, Field(min_length=1, max_length=100)]

#: Sim time is counted in ticks; a hundred days are more than any session.
_Time = Annotated[float, Field(ge=0, le=8.64e6)]
_Duration = Annotated[float, Field(ge=0.01, le=8.64e6)]
_Delay = Annotated[float, Field(ge=0, le=5)]
_Offset = Annotated[float, Field(ge=-100, le=100)]


class _Fault(Spec):
    """What every fault has."""

    summary: ClassVar[str]
    start_s: _Time = 0.0
    """Sim time at which it begins [s]; in the live command, counted from the command."""
    duration_s: _Duration | None = None
    """How long it lasts [s], at least a tick; without it, to the end."""


class GnssOutage(_Fault):
    """The receiver has no position (antenna cable, jamming); afterwards it reacquires and converges."""

    summary: ClassVar[str] = "the GNSS receiver has no position"
    kind: Literal["gnss-outage"]


class GnssDegraded(_Fault):
    """The solution is no better than `fix`; with `claimed_m` the receiver is over-confident about it."""

    summary: ClassVar[str] = "the GNSS solution is degraded"
    kind: Literal["gnss-degraded"]
    fix: Literal["single", "float"] = "float"
    claimed_m: Annotated[float, Field(ge=0.001, le=100)] | None = None
    """Reported 1 σ per axis [m]; by default what the scenario's receiver would report."""


class CorrectionsLost(_Fault):
    """No RTK corrections arrive: the fix is held and drifts, then the solution jumps by metres."""

    summary: ClassVar[str] = "no RTK corrections arrive"
    kind: Literal["corrections-lost"]


class GnssWrongFix(_Fault):
    """A wrong fix: reported as fixed and accurate, and off by this much."""

    summary: ClassVar[str] = "the GNSS has a wrong fix"
    kind: Literal["gnss-wrong-fix"]
    east_m: _Offset = 0.3
    north_m: _Offset = 0.0


class GnssNoisy(_Fault):
    """Interference: the white noise of the positions grows, the reported variance does (`honest`) or does not."""

    summary: ClassVar[str] = "the GNSS is disturbed"
    kind: Literal["gnss-noisy"]
    white_m: Annotated[float, Field(gt=0, le=100)] = 0.05
    honest: bool = True


class CameraOutage(_Fault):
    """The camera overhead does not find the robot: somebody stands in the way, the light is off."""

    summary: ClassVar[str] = "the camera does not see the robot"
    kind: Literal["camera-outage"]


class MessagesLate(_Fault):
    """Every message of a sensor comes this much later."""

    summary: ClassVar[str] = "messages come late"
    kind: Literal["messages-late"]
    sensor: Sensor
    delay_s: Annotated[float, Field(gt=0, le=5)]


class MessagesDuplicated(_Fault):
    """Messages come a second time, `after_s` later."""

    summary: ClassVar[str] = "messages come twice"
    kind: Literal["messages-duplicated"]
    sensor: Sensor
    after_s: _Delay = 0.0
    share: Share = 1.0


class MessagesReordered(_Fault):
    """Every message takes a random extra time up to `spread_s`, so that they overtake each other."""

    summary: ClassVar[str] = "messages come out of order"
    kind: Literal["messages-reordered"]
    sensor: Sensor
    spread_s: Annotated[float, Field(gt=0, le=5)] = 0.25


class MessagesLost(_Fault):
    """This share of a sensor's messages never comes."""

    summary: ClassVar[str] = "messages are lost"
    kind: Literal["messages-lost"]
    sensor: Sensor
    share: Share = 1.0


class ClockSkew(_Fault):
    """The receiver's clock is off against the robot's: its stamps are wrong by an offset and a drift."""

    summary: ClassVar[str] = "the GNSS receiver's clock is off"
    kind: Literal["clock-skew"]
    offset_s: Annotated[float, Field(ge=-5, le=5)] = 0.05
    drift_ppm: Annotated[float, Field(ge=-10000, le=10000)] = 0.0


class ImuBias(_Fault):
    """The yaw gyro and the forward accelerometer jump by a bias."""

    summary: ClassVar[str] = "the IMU's bias has jumped"
    kind: Literal["imu-bias"]
    gyro_radps: Annotated[float, Field(ge=-1, le=1)] = 0.02
    accel_mps2: Annotated[float, Field(ge=-10, le=10)] = 0.0


class ImuNoisy(_Fault):
    """Vibration: additional white noise on every axis of the IMU, per sample (1 σ)."""

    summary: ClassVar[str] = "the IMU vibrates"
    kind: Literal["imu-noisy"]
    gyro_radps: Annotated[float, Field(ge=0, le=10)] = 0.05
    accel_mps2: Annotated[float, Field(ge=0, le=100)] = 1.0


class ImuStuck(_Fault):
    """The IMU goes on sending its last reading."""

    summary: ClassVar[str] = "the IMU is frozen"
    kind: Literal["imu-stuck"]


class MagneticDisturbance(_Fault):
    """A field on top of the earth's, in the map frame: a parked car, a reinforced ditch cover."""

    summary: ClassVar[str] = "the magnetic field is disturbed"
    kind: Literal["magnetic-disturbance"]
    east_t: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 10e-6
    north_t: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 0.0


class ActuatorFault(_Fault):
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

    summary: ClassVar[str] = "a wheel encoder counts nothing"
    kind: Literal["encoder-dropout"]


class WheelBlocked(ActuatorFault):
    """A wheel is held fast."""

    summary: ClassVar[str] = "a wheel is blocked"
    kind: Literal["wheel-blocked"]
    actuator: _Actuator = "left"


class WheelSlip(ActuatorFault):
    """A wheel loses this share of its ground speed, on top of what it loses anyway: mud, a wet line."""

    summary: ClassVar[str] = "a wheel slips"
    kind: Literal["wheel-slip"]
    share: Annotated[float, Field(ge=-0.5, le=0.95)] = 0.2


class MotorWeak(ActuatorFault):
    """A motor has only this share of its torque."""

    summary: ClassVar[str] = "a motor is weak"
    kind: Literal["motor-weak"]
    actuator: _Actuator = "left"
    share: Share = 0.2


class SteeringOffset(ActuatorFault):
    """A steered wheel is off its encoder's angle by this much, to the left: a blow has bent its linkage.

    Of wheels that do not steer nothing changes.
    """

    summary: ClassVar[str] = "the steering is off"
    kind: Literal["steering-offset"]
    offset_rad: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.035


class ValveStuck(_Fault):
    """The paint valve stays where it is told not to be."""

    summary: ClassVar[str] = "the valve is stuck"
    kind: Literal["valve-stuck"]
    position: Literal["open", "closed"]


class DiscStuck(_Fault):
    """The paint discs stay up or down."""

    summary: ClassVar[str] = "the discs are stuck"
    kind: Literal["disc-stuck"]
    position: Literal["up", "down"]


class NozzleClogged(_Fault):
    """Only this share of the paint gets through."""

    summary: ClassVar[str] = "the nozzle is clogged"
    kind: Literal["nozzle-clogged"]
    share: Share = 0.3


class Bumper(_Fault):
    """The bumper is pressed."""

    summary: ClassVar[str] = "the bumper is pressed"
    kind: Literal["bumper"]


class BatteryLow(_Fault):
    """The battery gives no more than this share of its charge, until it is replaced: at the end, or by an order."""

    summary: ClassVar[str] = "the battery is low"
    kind: Literal["battery-low"]
    fraction: Share = 0.05


class TankEmpty(_Fault):
    """The tank gives no more than this much paint, until it is refilled: at the end, or by an order."""

    summary: ClassVar[str] = "the tank is empty"
    kind: Literal["tank-empty"]
    litres: Annotated[float, Field(ge=0, le=1000)] = 0.0


class OperatorLost(_Fault):
    """Nobody who could stop the robot can be heard, in sim time."""

    summary: ClassVar[str] = "the operator cannot be heard"
    kind: Literal["operator-lost"]


Fault = Annotated[
    GnssOutage
    | GnssDegraded
    | CorrectionsLost
    | GnssWrongFix
    | GnssNoisy
    | CameraOutage
    | MessagesLate
    | MessagesDuplicated
    | MessagesReordered
    | MessagesLost
    | ClockSkew
    | ImuBias
    | ImuNoisy
    | ImuStuck
    | MagneticDisturbance
    | EncoderDropout
    | WheelBlocked
    | WheelSlip
    | MotorWeak
    | SteeringOffset
    | ValveStuck
    | DiscStuck
    | NozzleClogged
    | Bumper
    | BatteryLow
    | TankEmpty
    | OperatorLost,
    Field(discriminator="kind"),
]


class _One(Spec):
    fault: Fault


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
