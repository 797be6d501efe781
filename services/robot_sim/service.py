"""Robots as a process: it serves commands, keeps the pace, and minds their links; a process of its own publishes.

The loop waits for nobody. Stops, of all its robots, are looked for before everything else and after every few ticks;
what takes long is done in other threads (`loading`) and processes (`outbox`); of everything else a bounded amount is
served in a turn. Robots share the loop and nothing else: each has its own emulator, pace, journal and handlers, so that
its bytes are the same alone and beside others.
"""

from __future__ import annotations

import gc
import math
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, Literal, Protocol

from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message
from touchline.schemas.setup import Setup
from touchline.services.bus import Bus, BusConfig, HealthReporter, ServedCall
from touchline.services.bus.calls import Server
from touchline.services.robot_sim.command_handlers import Commands, Handler
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import Quiet
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.loading import Loader, Prepared
from touchline.services.robot_sim.lockstep import Lockstep
from touchline.services.robot_sim.memory import give_back
from touchline.services.robot_sim.outbox import Outbox, RobotOutlet
from touchline.services.robot_sim.pace import LONGEST_SLICE_S, Pacer
from touchline.services.robot_sim.packing import Payload
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.robot_sim.together import check_together
from touchline.services.robot_sim.warm_up import warm_up
from touchline.services.system.priority import FIRST, run_at, switch_threads_soon
from touchline.services.system.shutdown import until_stopped

GUARDIANS: Final = frozenset((topics.CONSOLE, topics.OPERATOR, topics.PLANNER))
"""Of these nodes at least one must be on the bus while the robot drives by itself."""
PATIENCE_S: Final = 0.2
"""A client that does not take its answer within this is cut off; less would cut off honest ones on a busy machine."""
SERVED_AT_ONCE: Final = 4
"""Requests of one service in a turn; the others wait for the next one."""
WATCHDOG_S: Final = 0.2
"""Not commanded for so long in real time, valve and wheels stop by themselves."""
HEALTH_EVERY_S: Final = 0.02
"""How often at most it is looked whether anybody asks how things are."""
RESET_AFTER_S: Final = 0.5
"""A reset that comes sooner after an emergency stop was given before it, and is late: it must not undo the stop."""
TIDY_S: Final = 10.0
"""How often cyclic garbage is collected while no robot has anything to do; a collection amid a job could take long."""
IDLE_S: Final = 0.002
"""How long at most a turn sleeps while no tick is to come."""
BESIDE_EVERY_S: Final = 0.001
"""How often at most, amid the ticks of one robot, the stops of the others are looked for."""
BRAKING_TICKS: Final = 300
"""More than enough to come to rest."""
ClockPolicy = Literal["held", "free"]


def run_service(
    robots: Mapping[str, Setup],
    config: BusConfig | None = None,
    *,
    speed: float = 1.0,
    clock: ClockPolicy = "held",
    journal: Path | None = None,
    supervisor: int | None = None,
) -> None:
    """Be these robots until SIGTERM or SIGINT (or until `supervisor`, the parent process, is gone).

    Args:
        robots: By namespace, each with its computer and its world.
        config: Where the bus is.
        speed: Sim time per wall time: N is N× real time, 0 holds, negative is as fast as it goes.
        clock: `held`: sim time passes only while a traversal is under way or coming to rest, so that runs are
            reproducible; `free`: always.
        journal: Where is kept what another process would go on from; default: in the user's state folder.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration cannot be used, or these robots cannot be of one process.
        TouchlineError: One of them runs already.
    """
    check_together(robots, journal)
    config = (config or BusConfig.from_environment()).of(*robots)
    switch_threads_soon()
    run_at(FIRST)
    with (
        until_stopped(supervisor) as stop,
        Bus.open_all(topics.ROBOT_SIM, config, lambda: stop.asked, PATIENCE_S) as buses,
    ):
        outbox = Outbox(config)
        try:
            health = [HealthReporter(bus) for bus in buses]
            _warm_up(robots.values(), health)
            for bus in buses:
                bus.claim()
            gc.freeze()
            gc.disable()
            with ExitStack() as journals:
                host = RobotHost(
                    [
                        RobotProcess(
                            bus,
                            health[number],
                            setup,
                            RobotOutlet(outbox, number),
                            speed=speed,
                            clock=clock,
                            journal=journals.enter_context(Journal(journal or journal_path(bus.namespace))),
                        )
                        for number, (bus, setup) in enumerate(zip(buses, robots.values(), strict=True))
                    ]
                )
                while not stop:
                    host.turn()
                host.close()
        finally:
            outbox.close()


def _warm_up(setups: Iterable[Setup], health: Sequence[HealthReporter]) -> None:
    """Compile what these robots need; what differs in their worlds only needs nothing else."""

    def tell(doing: str) -> None:
        for reporter in health:
            reporter.starting(doing)

    done: list[tuple[object, object]] = []
    for setup in setups:
        kind = setup.vehicle, setup.onboard
        if kind not in done:
            done.append(kind)
            warm_up(tell, setup)


def journal_path(namespace: str) -> Path:
    """Where the robot of this namespace keeps its journal."""
    base = os.environ.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local" / "state") / "touchline" / f"{namespace}.journal"


class Outlet(Protocol):
    """Where telemetry goes, without the loop having to wait: an `Outbox`."""

    @property
    def behind(self) -> bool:
        """Whether so much waits that sim time should not run ahead."""

    @property
    def dropped(self) -> int:
        """Messages for which there was no room."""

    @property
    def restarts(self) -> int:
        """How often the process that publishes was replaced."""

    def send(self, payloads: Sequence[Payload]) -> None:
        """Publish, in this order."""

    def turn(self) -> bool:
        """Called in every turn of the loop; True if all paint has to be told anew."""


class RobotHost:
    """The robots of one process in one loop; call `turn` in a loop."""

    def __init__(self, robots: Sequence[RobotProcess]) -> None:
        """They take turns from now on."""
        self._robots = robots
        self._slice_s = LONGEST_SLICE_S / len(robots)
        for robot in robots:
            robot.beside = tuple(other for other in robots if other is not robot)

    def turn(self) -> None:
        """A turn of each robot, and sleep if nothing is due."""
        due_s = min([robot.step(self._slice_s) for robot in self._robots])
        time.sleep(max(0.0, due_s - time.monotonic()))

    def close(self) -> None:
        """End all runs in good order."""
        for robot in self._robots:
            robot.close()


class RobotProcess:
    """The emulator on the bus; call `turn` in a loop, or `step` in that of a `RobotHost`.

    Attributes:
        beside: The other robots of this process, whose stops are looked for whenever this one's are.
    """

    def __init__(
        self,
        bus: Bus,
        health: HealthReporter,
        setup: Setup,
        outlet: Outlet,
        *,
        speed: float,
        clock: ClockPolicy,
        journal: Journal | None = None,
    ) -> None:
        """Serve at once; nothing moves before a command."""
        self.beside: tuple[RobotProcess, ...] = ()
        self._beside_at_s = 0.0
        ask = Lockstep(bus, self._stop_waits)
        self._emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard, ask=ask)
        self._telemetry = Telemetry(self._emulator, report_at_once=False)
        self._reporting = ThreadPoolExecutor(1, "report")
        self._report: Future[m.TraversalReport] | None = None
        self._quiet = Quiet(self._emulator)
        self._pacer = Pacer(speed, time.monotonic())
        self._free = clock == "free"
        self._link = LinkWatch(bus, setup.onboard.link_timeout_s)
        self._rate = RateMeter()
        self._watchdog = Watchdog()
        self._outlet = outlet
        self._commands = Commands(self._emulator, self._telemetry, self._set_speed, journal)
        latch = LatchGuard()
        handlers = self._commands.handlers
        handlers[topics.ESTOP] = latch.stop(handlers[topics.ESTOP])
        handlers[topics.RESET] = latch.reset(handlers[topics.RESET])
        served = [(bus.serve(service), handler) for service, handler in handlers.items()]
        self._stops = [(server, handler) for server, handler in served if server.service.urgent]
        self._others = [(server, handler) for server, handler in served if not server.service.urgent]
        self._loads = [bus.serve(service) for service in self._commands.loads]
        self._loader = Loader()
        self._waiting: list[tuple[ServedCall[Any, Any], Handler]] = []
        self._health, self._told_state, self._health_at_s = health, -1, 0.0
        self._tidy_at_s = time.monotonic()
        self._publish([self._telemetry.setup(), *self._telemetry.standing(), *self._commands.take()])

    @property
    def active(self) -> bool:
        """Whether a traversal is under way or coming to rest."""
        return self._emulator.active

    def turn(self) -> None:
        """Serve what waits, run the ticks that are due (at most 10 ms of them), and sleep if there are none."""
        time.sleep(max(0.0, self.step(LONGEST_SLICE_S) - time.monotonic()))

    def step(self, slice_s: float) -> float:
        """Serve what waits and run the ticks that are due; returns until when (monotonic) nothing else is due.

        Args:
            slice_s: Ticks run for no longer than about this.
        """
        self._answer_all_stops(time.monotonic())
        self._mind_watchdog()
        self._serve()
        self._mind_report()
        self._mind_link()
        self._mind_outlet()
        now = time.monotonic()
        self._rate.note(now, self._emulator.tick_count)
        self._tell_health()
        if self._free or self._emulator.active:
            if not self._held:
                self._run(self._pacer.due(now), now + slice_s)
                now = time.monotonic()
                return now + self._pacer.wait_s(now)
        else:
            self._pacer.restart(now)
            self._tidy(now)
        return time.monotonic() + IDLE_S

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

    @property
    def _running(self) -> bool:
        return self._emulator.onboard.state == m.TraversalStatus.RUNNING

    @property
    def _held(self) -> bool:
        """Whether sim time stands still until the telemetry so far is on its way; never while the robot is to stop."""
        return self._pacer.factor < 0.0 and self._running and self._outlet.behind

    def _run(self, ticks: int, until_s: float) -> None:
        while ticks > 0 and (self._free or self._emulator.active):
            done = self._quiet.step(self._telemetry.until_due(ticks), self._telemetry.rows)
            self._publish(self._commands.note_progress())
            self._publish(self._telemetry.after(done))
            ticks -= done
            now = time.monotonic()
            self._answer_all_stops(now)
            if now >= until_s:
                self._pacer.give_back(ticks)
                return

    def _serve(self) -> None:
        for server, handler in self._others:
            for _ in range(SERVED_AT_ONCE):
                if (call := server.poll()) is None:
                    break
                self._answer(call, handler)
        for server in self._loads:
            for _ in range(SERVED_AT_ONCE):
                if (call := server.poll_unread()) is None:
                    break
                self._begin_load(call, server)
        while self._telemetry.ended is None and (prepared := self._loader.poll()) is not None:
            self._end_load(prepared)

    def _begin_load(self, call: ServedCall[Any, Any], server: Server[Any, Any]) -> None:
        """Have a load prepared, unless it would be refused whatever is in it: then it is not even read."""
        load = self._commands.loads[server.service]
        if problem := self._commands.check_load():
            call.reply(load.refuse(problem))
            self._publish(self._commands.take())
        elif self._loader.busy:
            call.fail("other plans are being loaded; try again later")
        else:
            self._loader.prepare(call, load)

    def _end_load(self, prepared: Prepared) -> None:
        call, load, ready = prepared
        if isinstance(ready, PayloadError):
            call.reject(ready)
        elif ready is None:
            call.fail("the robot could not read this plan: a defect; its log has the details")
        else:
            response = load.refuse(str(ready)) if isinstance(ready, Exception) else load.take(ready)
            self._publish(self._commands.take())
            call.reply(response)

    def _answer(self, call: ServedCall[Any, Any], handler: Handler) -> None:
        response = handler(call.request)
        self._publish(self._commands.take())
        call.reply(response)

    def _stop_waits(self) -> bool:
        """Whether somebody wants to stop the robot; in the middle of a tick, so it is answered after that."""
        for server, handler in self._stops:
            for _ in range(SERVED_AT_ONCE):
                if (call := server.poll()) is None:
                    break
                self._waiting.append((call, handler))
        return bool(self._waiting)

    def _answer_all_stops(self, now_s: float) -> None:
        """Those of this robot, and now and then those of the others in this process."""
        self.answer_stops()
        if now_s >= self._beside_at_s:
            self._beside_at_s = now_s + BESIDE_EVERY_S
            for robot in self.beside:
                robot.answer_stops()

    def answer_stops(self) -> None:
        """Carry out what stops this robot; between ticks only."""
        self._stop_waits()
        waiting, self._waiting = self._waiting, []
        for call, handler in waiting:
            self._answer(call, handler)

    def _tell_health(self) -> None:
        """Tell how things are, a new state at once: by a way of its own, should the telemetry be held up."""
        state, now_s = self._emulator.onboard.state, time.monotonic()
        changed, self._told_state = state != self._told_state, state
        if not changed and now_s < self._health_at_s:
            return
        self._health_at_s = now_s + HEALTH_EVERY_S
        message = self._emulator.onboard.status.reason or "ok"
        self._health.poll(self._diagnostics(), message=message, at_once=changed)

    def _mind_report(self) -> None:
        """Have the report of a traversal that has ended made in a thread, and publish it: nothing is loaded before."""
        if self._telemetry.ended is None:
            return
        if self._report is None:
            self._report = self._reporting.submit(self._telemetry.ended.final_report)
        elif self._report.done():
            self._publish([self._telemetry.conclude(self._report.result())])
            self._report = None

    def _mind_link(self) -> None:
        if not self._link.lost(self._running, time.monotonic()):
            return
        self._commands.link_lost()
        self._publish(self._commands.take())

    def _mind_watchdog(self) -> None:
        missed_s = self._watchdog.missed_s(time.monotonic())
        if missed_s > WATCHDOG_S and self._running and 0.0 < self._pacer.factor <= 1.0:
            self._commands.fail_safe(missed_s)
            self._publish(self._commands.take())

    def _mind_outlet(self) -> None:
        if self._outlet.turn():
            self._publish(self._telemetry.all_paint())

    @property
    def at_rest(self) -> bool:
        """Whether nothing of this robot would suffer from a pause of the process."""
        return self._loader.idle and not self._emulator.active

    def _tidy(self, now_s: float) -> None:
        robots = (self, *self.beside)
        if now_s > self._tidy_at_s and all(robot.at_rest for robot in robots):
            for robot in robots:
                robot._tidy_at_s = now_s + TIDY_S
            give_back()

    def _set_speed(self, factor: float) -> None:
        self._pacer.set_factor(factor, time.monotonic())

    def _publish(self, payloads: list[Payload]) -> None:
        if payloads:
            self._outlet.send(payloads)

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
            "telemetry_dropped": self._outlet.dropped,
            "telemetry_restarts": self._outlet.restarts,
        }


class Watchdog:
    """For how long the loop had not turned, at each turn."""

    def __init__(self) -> None:
        """It has never turned."""
        self._turned_s: float | None = None

    def missed_s(self, now_s: float) -> float:
        """Since the last turn; this is one."""
        missed_s = now_s - self._turned_s if self._turned_s is not None else 0.0
        self._turned_s = now_s
        return missed_s


class LatchGuard:
    """Keeps a reset that was given before an emergency stop, and served after it, from undoing it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """No stop yet."""
        self._clock = clock
        self._stopped_at_s = -math.inf

    def stop(self, handler: Handler) -> Handler:
        """The emergency stop's handler, watched."""

        def handle(request: Any) -> Message:
            self._stopped_at_s = self._clock()
            return handler(request)

        return handle

    def reset(self, handler: Handler) -> Handler:
        """The reset's handler, guarded."""

        def handle(request: Any) -> Message:
            since_s = self._clock() - self._stopped_at_s
            if since_s < RESET_AFTER_S:
                text = f"the emergency stop was given only {since_s:.1f} s ago; reset again if it is safe"
                return m.CommandResponse(success=False, message=text)
            return handler(request)

        return handle


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
