"""The timeline of faults: which are acting in a tick, and what they add up to."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple, Self

import numpy as np

from touchline.onboard.interface import TICKS_PER_S, OnboardEvent
from touchline.schemas import faults as f
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.messages import Event
from touchline.schemas.vehicles import DriveSpec
from touchline.services.robot_sim.sensors.gnss import FIX_NAMES
from touchline.services.robot_sim.world.effects import SENSORS, Effects

MAX_FAULTS: Final = 1000
_NEVER: Final = 1 << 60


class TimedFault(NamedTuple):
    """A fault, from its first to its last tick."""

    first_tick: int
    last_tick: float
    fault: f.Fault

    def as_json(self) -> list[Any]:
        """Values as in JSON, for `from_json`."""
        last_tick = None if math.isinf(self.last_tick) else int(self.last_tick)
        return [self.first_tick, last_tick, self.fault.model_dump(mode="json", exclude_none=True)]

    @classmethod
    def from_json(cls, told: list[Any]) -> Self:
        """The fault that was told.

        Raises:
            SpecError, ValueError, TypeError: It is none.
        """
        first_tick, last_tick, fault = told
        return cls(int(first_tick), math.inf if last_tick is None else int(last_tick), f.parse_fault(json.dumps(fault)))


class _Entry(NamedTuple):
    first_tick: int
    last_tick: float
    fault: f.Fault
    actuators: tuple[int, ...]
    """Numbers of those that it is a fault of, if it is one of actuators."""


class FaultTimeline:
    """Follows the faults through sim time; costs one comparison in a tick in which nothing changes.

    Attributes:
        effects: The sum of what acts in the tick of the last `step`; changed in place.
    """

    def __init__(self, faults: Iterable[f.Fault], drive: DriveSpec) -> None:
        """The scenario's faults, and the drive of the vehicle that they come upon.

        Raises:
            SpecError: A fault is of an actuator that the drive does not have.
        """
        self._names = tuple(actuator.name for actuator in drive.actuators)
        self.effects = Effects.sized(len(self._names))()
        self._entries: list[_Entry] = []
        self._active: list[_Entry] = []
        self._next_change = math.inf
        self._events: list[OnboardEvent] = []
        for number, fault in enumerate(faults):
            self._add(fault, 0, "scenario", f"faults[{number}].")

    def inject(self, fault: f.Fault, tick: int) -> None:
        """Add a fault whose `start_s` counts from the end of `tick`.

        Raises:
            CommandRefused: There are too many already.
            SpecError: It is of an actuator that the drive does not have.
        """
        if len(self._entries) >= MAX_FAULTS:
            raise CommandRefused(f"{MAX_FAULTS} faults are acting or waiting already; start the robot anew")
        self._add(fault, tick, "fault", "")
        when = f"in {fault.start_s:g} s" if fault.start_s > 0.0 else "now"
        lasting = "to the end" if fault.duration_s is None else f"for {fault.duration_s:g} s"
        text = f"{f.describe(fault)}, {when}, {lasting}"
        self._events.append(OnboardEvent(Event.WARN, "fault-injected", text))

    def mend(self, kind: type[f.Fault], tick: int) -> None:
        """End, with `tick`, the faults of a kind that act in it: somebody has done something about them."""
        mended = [entry for entry in self._active if isinstance(entry.fault, kind)]
        self._entries = [entry._replace(last_tick=tick) if entry in mended else entry for entry in self._entries]
        self._active = [entry._replace(last_tick=tick) if entry in mended else entry for entry in self._active]
        if mended:
            self._next_change = min(self._next_change, tick + 1)

    def step(self, tick: int) -> None:
        """Bring `effects` up to `tick`; ticks must not go back."""
        if tick < self._next_change:
            return
        before = self._active
        self._let_act(tick)
        for entry in self._active:
            if entry not in before:
                self._events.append(OnboardEvent(Event.WARN, "fault-begins", f.describe(entry.fault)))
        for entry in before:
            if entry not in self._active:
                self._events.append(OnboardEvent(Event.INFO, "fault-ends", f"no longer: {entry.fault.summary}"))

    def _let_act(self, tick: int) -> None:
        """Have act in a tick what is to."""
        self._active = [entry for entry in self._entries if entry.first_tick <= tick <= entry.last_tick]
        self._entries = [entry for entry in self._entries if entry.last_tick >= tick]
        self._next_change = min(
            (entry.first_tick if entry.first_tick > tick else entry.last_tick + 1 for entry in self._entries),
            default=math.inf,
        )
        self.effects.reset()
        for entry in self._active:
            _apply(entry, self.effects)

    @property
    def timed(self) -> tuple[TimedFault, ...]:
        """What acts or is still to come."""
        return tuple(TimedFault(*entry[:3]) for entry in self._entries)

    def restore(self, faults: Sequence[TimedFault], tick: int) -> None:
        """Have these faults, and no others, as after a tick; there is nothing to tell of them.

        Raises:
            SpecError: One is of an actuator that the drive does not have.
        """
        self._entries = [_Entry(*each, self._numbers(each.fault, "fault", "")) for each in faults[:MAX_FAULTS]]
        self._let_act(tick)

    @property
    def unchanged_until(self) -> int:
        """The last tick before something begins or ends."""
        return int(min(self._next_change, _NEVER)) - 1

    @property
    def no_events(self) -> bool:
        """Whether nothing began or ended since the last `take_events`."""
        return not self._events

    def take_events(self) -> list[OnboardEvent]:
        """What began and ended since the last call."""
        events, self._events = self._events, []
        return events

    def _add(self, fault: f.Fault, from_tick: int, source: str, place: str) -> None:
        actuators = self._numbers(fault, source, place)
        first = from_tick + round(fault.start_s * TICKS_PER_S) + 1
        last = math.inf if fault.duration_s is None else first + max(round(fault.duration_s * TICKS_PER_S), 1) - 1
        self._entries.append(_Entry(first, last, fault, actuators))
        self._next_change = min(self._next_change, first)

    def _numbers(self, fault: f.Fault, source: str, place: str) -> tuple[int, ...]:
        """Of the actuators that it is a fault of.

        Raises:
            SpecError: There is none of that name; it is found in `source`, at this place.
        """
        if not isinstance(fault, f.ActuatorFault):
            return ()
        if fault.actuator == f.ALL:
            return tuple(range(len(self._names)))
        if fault.actuator not in self._names:
            remedy = f"give {', '.join(map(repr, self._names))} or {f.ALL!r}: the vehicle's drive has no other"
            raise SpecError(source, f"{place}actuator", f"is {fault.actuator!r}", remedy)
        return (self._names.index(fault.actuator),)


def _apply(entry: _Entry, effects: Effects) -> None:
    """Add one acting fault to `effects`."""
    fault, start_s = entry.fault, (entry.first_tick - 1) / TICKS_PER_S
    match fault:
        case f.GnssOutage() | f.GnssDegraded() | f.CorrectionsLost() | f.GnssWrongFix() | f.GnssNoisy() | f.ClockSkew():
            _apply_gnss(fault, start_s, effects)
        case f.MessagesLate() | f.MessagesDuplicated() | f.MessagesReordered() | f.MessagesLost():
            _apply_messages(fault, effects)
        case f.CameraOutage():
            effects.camera_out = True
        case f.ImuBias():
            effects.gyro_bias_radps += fault.gyro_radps
            effects.accel_bias_mps2 += fault.accel_mps2
        case f.ImuNoisy():
            effects.gyro_white_radps = math.hypot(effects.gyro_white_radps, fault.gyro_radps)
            effects.accel_white_mps2 = math.hypot(effects.accel_white_mps2, fault.accel_mps2)
        case f.ImuStuck():
            effects.imu_stuck = True
        case f.MagneticDisturbance():
            effects.field_east_t += fault.east_t
            effects.field_north_t += fault.north_t
        case f.ActuatorFault():
            _apply_actuators(fault, list(entry.actuators), effects)
        case _:
            _apply_body(fault, effects)


def _apply_gnss(
    fault: f.GnssOutage | f.GnssDegraded | f.CorrectionsLost | f.GnssWrongFix | f.GnssNoisy | f.ClockSkew,
    start_s: float,
    effects: Effects,
) -> None:
    match fault:
        case f.GnssOutage():
            effects.fix_cap = FIX_NAMES["none"]
        case f.GnssDegraded():
            effects.fix_cap = min(effects.fix_cap, FIX_NAMES[fault.fix])
            if fault.claimed_m is not None:
                effects.claimed_m = min(effects.claimed_m or math.inf, fault.claimed_m)
        case f.CorrectionsLost():
            effects.corrections_lost = True
        case f.GnssWrongFix():
            effects.gnss_offset_m += fault.east_m, fault.north_m
        case f.GnssNoisy():
            effects.gnss_white_m = math.hypot(effects.gnss_white_m, fault.white_m)
            if not fault.honest:
                effects.gnss_hidden_m = math.hypot(effects.gnss_hidden_m, fault.white_m)
        case f.ClockSkew():
            drift = fault.drift_ppm * 1e-6
            effects.clock_offset_s += fault.offset_s - drift * start_s
            effects.clock_drift += drift


def _apply_messages(
    fault: f.MessagesLate | f.MessagesDuplicated | f.MessagesReordered | f.MessagesLost, effects: Effects
) -> None:
    messages, sensor = effects.messages, SENSORS.index(fault.sensor)
    match fault:
        case f.MessagesLate():
            messages.late_ticks[sensor] += _ticks(fault.delay_s)
        case f.MessagesReordered():
            messages.spread_ticks[sensor] = max(messages.spread_ticks[sensor], _ticks(fault.spread_s))
        case f.MessagesLost():
            messages.lost_share[sensor] = max(messages.lost_share[sensor], fault.share)
        case f.MessagesDuplicated():
            messages.again_share[sensor] = max(messages.again_share[sensor], fault.share)
            messages.again_ticks[sensor] = max(messages.again_ticks[sensor], _ticks(fault.after_s))


def _apply_actuators(fault: f.ActuatorFault, actuators: list[int], effects: Effects) -> None:
    match fault:
        case f.EncoderDropout():
            effects.encoder_out[actuators] = 1
        case f.WheelBlocked():
            effects.blocked[actuators] = 1
        case f.WheelSlip():
            for number in actuators:
                effects.slip[number] = max(effects.slip[number], fault.share, key=lambda share: (abs(share), share))
        case f.SteeringOffset():
            effects.offset_rad[actuators] += fault.offset_rad
        case f.MotorWeak():
            effects.torque_share[actuators] = np.minimum(effects.torque_share[actuators], fault.share)


def _apply_body(fault: f.Fault, effects: Effects) -> None:
    match fault:
        case f.ValveStuck():
            effects.valve = max(effects.valve, 1.0 if fault.position == "open" else 0.0)
        case f.DiscStuck():
            effects.disc = max(effects.disc, 1.0 if fault.position == "down" else 0.0)
        case f.NozzleClogged():
            effects.flow_share = min(effects.flow_share, fault.share)
        case f.Bumper():
            effects.bumper = True
        case f.BatteryLow():
            effects.battery_share = min(effects.battery_share, fault.fraction)
        case f.TankEmpty():
            effects.tank_max_l = min(effects.tank_max_l, fault.litres)
        case f.OperatorLost():
            effects.operator_lost = True


def _ticks(seconds: float) -> float:
    """Whole ticks, at least one for anything above zero."""
    return float(max(round(seconds * TICKS_PER_S), 1)) if seconds > 0.0 else 0.0
