"""Timeline of faults: those acting in a tick, and the sum of their effects."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple, Self

from touchline.onboard.interface import TICKS_PER_S, OnboardEvent
from touchline.schemas import faults as f
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.messages import Event
from touchline.schemas.plugin_packages import PluginError
from touchline.schemas.plugins import FAULTS, part_for
from touchline.schemas.vehicles import DriveSpec
from touchline.services.robot_sim.fault_effects.acting import Acting, ApplyFault
from touchline.services.robot_sim.world.effects import Effects

MAX_FAULTS: Final = 1000
_NEVER: Final = 1 << 60


class TimedFault(NamedTuple):
    """A fault with its first and last tick."""

    first_tick: int
    last_tick: float
    fault: f.Fault

    def as_json(self) -> list[Any]:
        """Return the values as in JSON, for `from_json`."""
        last_tick = None if math.isinf(self.last_tick) else int(self.last_tick)
        return [self.first_tick, last_tick, self.fault.model_dump(mode="json", exclude_none=True)]

    @classmethod
    def from_json(cls, values: list[Any]) -> Self:
        """Read a fault from the result of `as_json`.

        Raises:
            SpecError, ValueError, TypeError: It is not a fault.
        """
        first_tick, last_tick, fault = values
        return cls(int(first_tick), math.inf if last_tick is None else int(last_tick), f.parse_fault(json.dumps(fault)))


class _Entry(NamedTuple):
    first_tick: int
    last_tick: float
    fault: f.Fault
    apply: ApplyFault
    acting: Acting


class FaultTimeline:
    """Faults over sim time; costs one comparison in a tick in which nothing changes.

    Attributes:
        effects: Sum of the effects in the tick of the last `step`; changed in place.
    """

    def __init__(self, faults: Iterable[f.Fault], drive: DriveSpec) -> None:
        """Take the scenario's faults, for the drive of a vehicle.

        Args:
            faults: Faults of the scenario.
            drive: Drive of the vehicle.

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
        """Add a fault whose `start_s` counts from the end of a tick.

        Args:
            fault: The fault.
            tick: The tick.

        Raises:
            CommandRefused: There are too many already.
            SpecError: It is of an actuator that the drive does not have.
            TouchlineError: It is of another package, and its function fails, or cannot be found.
        """
        if len(self._entries) >= MAX_FAULTS:
            raise CommandRefused(f"{MAX_FAULTS} faults are acting or waiting already; start the robot anew")
        self._add(fault, tick, "fault", "")
        when = f"in {fault.start_s:g} s" if fault.start_s > 0.0 else "now"
        lasting = "to the end" if fault.duration_s is None else f"for {fault.duration_s:g} s"
        text = f"{f.describe(fault)}, {when}, {lasting}"
        self._events.append(OnboardEvent(Event.WARN, "fault-injected", text))

    def mend(self, kind: type[f.Fault], tick: int) -> None:
        """End the acting faults of a kind, because somebody has repaired them.

        Args:
            kind: Class of the faults.
            tick: Their last tick.
        """
        mended = [entry for entry in self._active if isinstance(entry.fault, kind)]
        self._entries = [entry._replace(last_tick=tick) if entry in mended else entry for entry in self._entries]
        self._active = [entry._replace(last_tick=tick) if entry in mended else entry for entry in self._active]
        if mended:
            self._next_change = min(self._next_change, tick + 1)

    def step(self, tick: int) -> None:
        """Update `effects` to a tick; ticks must not go back."""
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
        """Apply the faults of a tick."""
        self._active = [entry for entry in self._entries if entry.first_tick <= tick <= entry.last_tick]
        self._entries = [entry for entry in self._entries if entry.last_tick >= tick]
        self._next_change = min(
            (entry.first_tick if entry.first_tick > tick else entry.last_tick + 1 for entry in self._entries),
            default=math.inf,
        )
        self.effects.reset()
        for entry in self._active:
            entry.apply(entry.fault, self.effects, entry.acting)

    @property
    def timed(self) -> tuple[TimedFault, ...]:
        """Faults that act or are still to come."""
        return tuple(TimedFault(*entry[:3]) for entry in self._entries)

    def restore(self, faults: Sequence[TimedFault], tick: int) -> None:
        """Replace all faults by these, as after a tick, without events.

        Args:
            faults: The faults.
            tick: The tick.

        Raises:
            SpecError: One is of an actuator that the drive does not have.
        """
        self._entries = [self._entry(each, "fault", "") for each in faults[:MAX_FAULTS]]
        self._let_act(tick)

    @property
    def unchanged_until(self) -> int:
        """Last tick before a fault begins or ends."""
        return int(min(self._next_change, _NEVER)) - 1

    @property
    def no_events(self) -> bool:
        """True if no fault began or ended since the last `take_events`."""
        return not self._events

    def take_events(self) -> list[OnboardEvent]:
        """Return and clear the events of faults that began and ended."""
        events, self._events = self._events, []
        return events

    def _add(self, fault: f.Fault, from_tick: int, source: str, place: str) -> None:
        first = from_tick + round(fault.start_s * TICKS_PER_S) + 1
        last = math.inf if fault.duration_s is None else first + max(round(fault.duration_s * TICKS_PER_S), 1) - 1
        self._entries.append(self._entry(TimedFault(first, last, fault), source, place))
        self._next_change = min(self._next_change, first)

    def _entry(self, timed: TimedFault, source: str, place: str) -> _Entry:
        """Make the entry of a fault, with the function of its kind.

        Raises:
            SpecError: It is of an actuator that the drive does not have; it is found in `source`, at this place.
            PluginError: It is of another package, and its function fails.
        """
        fault = timed.fault
        acting = Acting((timed.first_tick - 1) / TICKS_PER_S, self._numbers(fault, source, place))
        apply: ApplyFault = part_for(FAULTS, fault.kind, "world", source)
        if not FAULTS.is_shipped(fault.kind):
            _tried(fault, apply, acting, len(self._names))
        return _Entry(*timed, apply, acting)

    def _numbers(self, fault: f.Fault, source: str, place: str) -> list[int]:
        """Return the indices of the actuators that a fault affects.

        Raises:
            SpecError: There is none of that name; it is found in `source`, at this place.
        """
        if not isinstance(fault, f.ActuatorFault):
            return []
        if fault.actuator == f.ALL:
            return list(range(len(self._names)))
        if fault.actuator not in self._names:
            remedy = f"give {', '.join(map(repr, self._names))} or {f.ALL!r}: the vehicle's drive has no other"
            raise SpecError(source, f"{place}actuator", f"is {fault.actuator!r}", remedy)
        return [self._names.index(fault.actuator)]


def _tried(fault: f.Fault, apply: ApplyFault, acting: Acting, actuators: int) -> None:
    """Apply a fault of another package to a robot without faults, so that a failure occurs here, not in the loop.

    Raises:
        PluginError: Its function fails.
    """
    try:
        apply(fault, Effects.sized(actuators)(), acting)
    except Exception as error:
        problem = f"{FAULTS.described(fault.kind)} fails with {type(error).__name__}: {error}"
        raise PluginError(f"{problem}; mend it, or leave it out") from error
