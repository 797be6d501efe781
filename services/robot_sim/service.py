"""The robot as a process: it serves commands, keeps the pace, publishes telemetry and minds its links."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, Final, Literal

from schemas import messages as m
from schemas import topics
from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.bus import Bus, BusConfig, HealthReporter, ServedCall
from services.lifecycle import until_stopped
from services.robot_sim.commands import Commands, Handler
from services.robot_sim.emulator import Emulator
from services.robot_sim.journal import Journal
from services.robot_sim.lockstep import Lockstep
from services.robot_sim.pace import LONGEST_SLICE_S, Pacer
from services.robot_sim.packing import Payload
from services.robot_sim.quiet import Quiet
from services.robot_sim.telemetry import Telemetry
from services.robot_sim.warm_up import warm_up

GUARDIANS: Final = frozenset((topics.CONSOLE, topics.OPERATOR, topics.PLANNER))
"""Of these nodes at least one must be on the bus while the robot drives by itself."""
STOPS: Final = (topics.ESTOP, topics.PAUSE, topics.ABORT)
"""What is looked for also while a tick waits for an external follower."""
BRAKING_TICKS: Final = 300
"""More than enough to come to rest."""
ClockPolicy = Literal["held", "free"]


def run_service(
    config: BusConfig | None = None,
    vehicle: Vehicle | None = None,
    scenario: Scenario | None = None,
    *,
    speed: float = 1.0,
    clock: ClockPolicy = "held",
    journal: Path | None = None,
    supervisor: int | None = None,
) -> None:
    """Be the robot until SIGTERM or SIGINT (or until `supervisor`, the parent process, is gone).

    Args:
        config: Where the bus is.
        vehicle: The robot; default: the Turf Tank Two.
        scenario: What may go differently; default: default noise, seed 1.
        speed: Sim time per wall time: N is N× real time, 0 holds, negative is as fast as it goes.
        clock: `held`: sim time passes only while a traversal is under way or coming to rest, so that runs are
            reproducible; `free`: always.
        journal: Where is kept what another process would go on from; default: in the user's state folder.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration cannot be used.
        TouchlineError: This robot runs already.
    """
    vehicle, scenario = vehicle or Vehicle(), scenario or Scenario()
    with until_stopped(supervisor) as stop, Bus.open(topics.ROBOT_SIM, config) as bus:
        health = HealthReporter(bus)
        warm_up(health.starting, vehicle, scenario)
        bus.claim()
        with Journal(journal or journal_path(bus.config.namespace)) as kept:
            robot = RobotProcess(bus, health, vehicle, scenario, speed=speed, clock=clock, journal=kept)
            while not stop:
                robot.turn()
            robot.close()


def journal_path(namespace: str) -> Path:
    """Where the robot of this namespace keeps its journal."""
    base = os.environ.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local" / "state") / "touchline" / f"{namespace}.journal"


class RobotProcess:
    """The emulator on the bus; call `turn` in a loop."""

    def __init__(
        self,
        bus: Bus,
        health: HealthReporter,
        vehicle: Vehicle,
        scenario: Scenario,
        *,
        speed: float,
        clock: ClockPolicy,
        journal: Journal | None = None,
    ) -> None:
        """Serve at once; nothing moves before a command."""
        self._emulator = Emulator(vehicle, scenario, ask=Lockstep(bus, self._stop_waits))
        self._telemetry = Telemetry(self._emulator)
        self._quiet = Quiet(self._emulator)
        self._pacer = Pacer(speed, time.monotonic())
        self._free = clock == "free"
        self._link = LinkWatch(bus, scenario.link_timeout_s)
        self._rate = RateMeter()
        self._send = {
            topic.name: bus.publisher(topic).send_bytes
            for topic in topics.TOPICS
            if topic not in (topics.PLANNER_PROGRESS, topics.DIAGNOSTICS, topics.SUPERVISOR_EVENTS)
        }
        self._commands = Commands(self._emulator, self._telemetry, self._set_speed, journal)
        self._servers = [(bus.serve(service), handler) for service, handler in self._commands.handlers.items()]
        self._stops = [pair for pair in self._servers if pair[0].service in STOPS]
        self._waiting: list[tuple[ServedCall[Any, Any], Handler]] = []
        self._health = health
        self._publish([self._telemetry.setup(), self._telemetry.status(), *self._commands.take()])

    @property
    def active(self) -> bool:
        """Whether a traversal is under way or coming to rest."""
        return self._emulator.active

    def turn(self) -> None:
        """Serve what waits, run the ticks that are due (at most 20 ms of them), and sleep if there are none."""
        self._serve()
        self._mind_link()
        now = time.monotonic()
        self._rate.note(now, self._emulator.tick_count)
        self._health.poll(self._diagnostics(), message=self._emulator.onboard.status.reason or "ok")
        if self._free or self._emulator.active:
            self._run(self._pacer.due(now), now + LONGEST_SLICE_S)
            time.sleep(self._pacer.wait_s(time.monotonic()))
        else:
            self._pacer.restart(now)
            time.sleep(0.002)

    def close(self) -> None:
        """End a run in good order: valve closed and the robot braked, whatever the pace."""
        if self._emulator.onboard.state != m.TraversalStatus.RUNNING:
            return
        self._commands.shut_down()
        self._publish(self._commands.take())
        for _ in range(BRAKING_TICKS):
            self._emulator.tick()
            self._publish(self._commands.note_progress())
            self._publish(self._telemetry.after_tick())

    def _run(self, ticks: int, until_s: float) -> None:
        while ticks > 0 and (self._free or self._emulator.active):
            done = self._quiet.step(self._telemetry.until_due(ticks), self._telemetry.rows)
            self._publish(self._commands.note_progress())
            self._publish(self._telemetry.after(done))
            ticks -= done
            self._answer_stops()
            if time.monotonic() >= until_s:
                self._pacer.give_back(ticks)
                return

    def _serve(self) -> None:
        self._answer_stops()
        for server, handler in self._servers:
            while (call := server.poll()) is not None:
                self._answer(call, handler)

    def _answer(self, call: ServedCall[Any, Any], handler: Handler) -> None:
        response = handler(call.request)
        self._publish(self._commands.take())
        call.reply(response)

    def _stop_waits(self) -> bool:
        """Whether somebody wants to stop the robot; in the middle of a tick, so it is answered after that."""
        for server, handler in self._stops:
            while (call := server.poll()) is not None:
                self._waiting.append((call, handler))
        return bool(self._waiting)

    def _answer_stops(self) -> None:
        waiting, self._waiting = self._waiting, []
        for call, handler in waiting:
            self._answer(call, handler)

    def _mind_link(self) -> None:
        driving = self._emulator.onboard.state == m.TraversalStatus.RUNNING
        if not self._link.lost(driving, time.monotonic()):
            return
        self._commands.link_lost()
        self._publish(self._commands.take())

    def _set_speed(self, factor: float) -> None:
        self._pacer.set_factor(factor, time.monotonic())

    def _publish(self, payloads: list[Payload]) -> None:
        for topic, payload in payloads:
            self._send[topic.name](payload)

    def _diagnostics(self) -> dict[str, object]:
        return {
            "state": self._emulator.onboard.state,
            "sim_time_s": self._emulator.time_s,
            "ticks": self._emulator.tick_count,
            "speed_factor": self._pacer.factor,
            "real_time_factor": f"{self._rate.real_time_factor:.2f}",
            "follower_fallbacks": self._emulator.onboard.status.follower_fallbacks,
            "scenario": self._emulator.scenario.name,
            "seed": self._emulator.scenario.seed,
        }


class LinkWatch:
    """Whether everybody who could stop the robot has been gone for too long."""

    def __init__(self, bus: Bus, timeout_s: float) -> None:
        """Watch the bus."""
        self._presence = bus.presence()
        self._timeout_s = timeout_s
        self._seen_s: float | None = None

    def lost(self, driving: bool, now_s: float) -> bool:
        """True when `driving` and no guardian has been there for the time-out, counted from the start of driving."""
        self._presence.poll()
        if not driving or self._seen_s is None or GUARDIANS & self._presence.alive():
            self._seen_s = now_s
        return now_s - self._seen_s > self._timeout_s


class RateMeter:
    """Sim time per wall time, over about the last second."""

    def __init__(self) -> None:
        """Nothing measured yet."""
        self.real_time_factor = 0.0
        self._since = (0.0, 0)

    def note(self, now_s: float, ticks: int) -> None:
        """Enter the present wall time and tick count."""
        since_s, since_ticks = self._since
        if now_s - since_s < 1.0:
            return
        if since_s > 0.0:
            self.real_time_factor = (ticks - since_ticks) / 100 / (now_s - since_s)
        self._since = (now_s, ticks)
