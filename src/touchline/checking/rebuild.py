"""Rebuild of a session by the present code: the same robot, jobs and orders at the same ticks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from touchline.checking.recorded_session import GivenJob, NotRebuilt, RecordedSession, TimedOrder
from touchline.onboard import Onboard
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import Guidance, WayRound
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.initial_state import DamagedState, InitialState
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.packing import Payload
from touchline.services.robot_sim.recovery_state import restored_from
from touchline.services.robot_sim.sensors.auxiliary_truth import AuxiliaryTruth
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

SLICE_TICKS: Final = 1000
"""Ticks per slice of messages."""
MOST_LONGER_TICKS: Final = 360_000
"""Ticks after the recorded end at which a session is ended."""


class Rebuild:
    """A session being run again.

    Args:
        session: The recorded session.
        onboard: Computer of the robot; None: Touchline's own.
        sensors: Sensors of the robot, auxiliary ones apart; None: the emulated ones.

    Attributes:
        refused: Orders that the present robot refuses, with the reasons.

    Raises:
        NotRebuilt: Its initial state does not fit the present code.
    """

    def __init__(
        self,
        session: RecordedSession,
        onboard: Onboard | None = None,
        sensors: tuple[Sensors, AuxiliaryTruth] | None = None,
    ) -> None:
        setup = session.setup
        self._session = session
        self._emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard, onboard)
        if sensors is not None:
            self._emulator.sensors, self._emulator.auxiliary = sensors
        self._telemetry = Telemetry(self._emulator)
        if session.initial is not None:
            self._restore(session.initial)
        self._runner = FastRunner(self._emulator) if onboard is None else None
        self._jobs = iter(session.jobs)
        self.refused: list[str] = []
        emulator = self._emulator
        self._orders: Mapping[str, Callable[[Mapping[str, Any]], object]] = {
            "begin-guided": lambda details: emulator.begin_guided(
                plans=bool(details.get("plans")), margin_m=float(details.get("margin_m", 0.0))
            ),
            "guidance": lambda details: emulator.take_guidance(Guidance.model_validate(details)),
            "forget-cell": lambda _: emulator.forget_cell(),
            "start": lambda _: emulator.start(),
            "pause": lambda _: emulator.pause(),
            "watchdog": lambda details: emulator.fail_safe(float(details["missed_s"])),
            "shut-down": lambda _: emulator.shut_down(),
            "resume": self._resume,
            "abort": lambda details: emulator.abort(details["reason"]),
            "estop": lambda details: emulator.estop(details["reason"]),
            "reset": lambda _: emulator.reset(),
            "authorize": lambda details: emulator.authorize(_until_m(details)),
            "refill-tank": lambda _: emulator.refill_tank(),
            "replace-battery": lambda _: emulator.replace_battery(),
            "link-lost": lambda _: emulator.link_lost(),
            "way-round": lambda details: emulator.note_way_round(
                WayRound.model_validate(details["said"]), str(details["warning"])
            ),
            "inject-fault": lambda details: emulator.inject_fault(parse_fault(_json(details["fault"]))),
        }

    def _restore(self, initial: InitialState) -> None:
        try:
            self._emulator.restore(initial)
        except DamagedState as error:
            raise NotRebuilt(str(error)) from error
        except SpecError as error:
            raise NotRebuilt(f"the robot's state at the job's begin does not fit the present code: {error}") from error
        self._telemetry.go_on()

    @property
    def tick(self) -> int:
        """The last tick that was run."""
        return self._emulator.tick_count

    def messages(self) -> Iterator[list[Payload]]:
        """Yield the robot's messages in order, a slice at a time."""
        for order in self._session.orders:
            yield from self._until(order.tick)
            yield self._obey(order)
        yield from self._until(self._session.last_tick)

    def whole(self) -> Iterator[list[Payload]]:
        """Yield `messages`, with the setup before, and until the robot is at rest, unless it has refused an order."""
        yield [self._telemetry.setup(), *self._telemetry.standing(), *self._telemetry.awake()]
        yield from self.messages()
        most = self._session.last_tick + MOST_LONGER_TICKS
        while self._emulator.active and self.tick < most and not self.refused:
            yield from self._until(self.tick + MOST_TICKS)

    def _until(self, tick: int) -> Iterator[list[Payload]]:
        """Run up to a tick."""
        emulator, telemetry = self._emulator, self._telemetry
        while emulator.tick_count < tick:
            most = telemetry.until_due(min(SLICE_TICKS, tick - emulator.tick_count))
            if self._runner is None:
                emulator.tick()
                yield telemetry.after_tick()
                continue
            telemetry.hold(self._runner.step(most, telemetry.rows))
            if telemetry.full or emulator.tick_count >= tick or emulator.settled:
                yield telemetry.told()

    def _obey(self, order: TimedOrder) -> list[Payload]:
        try:
            if order.name == "load":
                return self._load(next(self._jobs), order)
            self._orders[order.name](order.details)
        except CommandRefused as error:
            self.refused.append(f"at {order.tick / 100:.2f} s the robot refuses to {order.name}: {error}")
            return []
        except (KeyError, TypeError, ValueError, OverflowError):
            self.refused.append(f"at {order.tick / 100:.2f} s there is an unknown order {order.name}")
            return []
        if order.name in ("refill-tank", "replace-battery"):
            return self._telemetry.supplies()
        if order.name == "begin-guided":
            return self._telemetry.begin([])
        silent = order.name in ("authorize", "guidance", "forget-cell") or "refused" in order.details
        return [] if silent else self._telemetry.news()

    def _resume(self, details: Mapping[str, Any]) -> None:
        try:
            self._emulator.resume()
        except CommandRefused:
            if "refused" not in details:
                raise

    def _load(self, job: GivenJob, order: TimedOrder) -> list[Payload]:
        taking = Taking[str(order.details.get("taking", "carried")).upper()]
        resume, remains = restored_from(order.details)
        self._emulator.take(self._emulator.prepare(job.trajectory, job.template, resume, remains, taking, job.cause))
        messages = self._telemetry.awake() + self._telemetry.loaded(job.trajectory, job.template)
        return messages + (self._telemetry.restored_paint() if remains is not None else [])


def _until_m(details: Mapping[str, Any]) -> float:
    until_m = details["until_m"]
    return float("inf") if until_m is None else float(until_m)


def _json(value: object) -> str:
    import json

    return json.dumps(value)
