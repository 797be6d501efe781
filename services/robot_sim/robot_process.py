"""One robot in a process: its loop serves commands, keeps the pace and monitors its links."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final, Literal

from touchline.bus import Bus, HealthReporter, ServedCall
from touchline.bus.calls import Server
from touchline.onboard.executive.traversal_states import NAMES
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message
from touchline.schemas.setup import Setup
from touchline.services.robot_sim.command_handlers import Commands, Guiding, Handler, Ready
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.goal_way.goal_service import GoalWayService
from touchline.services.robot_sim.goals import Goals
from touchline.services.robot_sim.guards import WATCHDOG_S, LatchGuard, LinkWatch, Watchdog
from touchline.services.robot_sim.guided_link import GuidedLink
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.loading import Loader, Prepared
from touchline.services.robot_sim.lockstep import Lockstep
from touchline.services.robot_sim.memory import give_back
from touchline.services.robot_sim.outbox import RobotOutlet
from touchline.services.robot_sim.pace import FORGIVEN_S, LONGEST_SLICE_S, Pacer, RateMeter
from touchline.services.robot_sim.packing import Payload
from touchline.services.robot_sim.recorder_limit import RecorderLimit
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.robot_sim.traversal_figures import Reports
from touchline.services.robot_sim.way_round.way_round_service import WayRoundService

_LOG: Final = logging.getLogger(__name__)
SERVED_AT_ONCE: Final = 4
"""Requests of one service that are served in a turn; others wait for the next one."""
HEALTH_EVERY_S: Final = 0.02
"""Shortest interval between checks for requests of diagnostics."""
TIDY_S: Final = 10.0
"""Interval at which cyclic garbage is collected while no robot has anything to do; a collection during a job could take
long."""
IDLE_S: Final = 0.002
"""Longest sleep of a turn while no tick is due."""
HELD_S: Final = 0.0005
"""Longest sleep of a turn while sim time waits for a coordinator's answer."""
LOOK_S, LATEST_LOOK_S = 0.001, 0.05
"""Delay per robot in a process with which each serves its commands, and its limit; stops are checked by `Beside`."""
BESIDE_EVERY_S: Final = 0.001
"""Shortest interval at which, amid the ticks of one robot, the stops of the others are checked."""
ROBOTS_A_TICK: Final = 5
"""Number of robots in a process per additional tick that is run at a time: the turns cost time, not the ticks. Stops
are checked less often by as much."""
IN_STEP_FORGIVEN_S: Final = 2.0
"""Lag that a robot which occasionally waits for its coordinator, and so for all others, catches up with."""
BRAKING_TICKS: Final = 300
"""More ticks than it takes to come to rest."""
HELD_BACK_S: Final = 1.0
"""Time for which it is reported that sim time was held for a slow receiver of telemetry."""
ClockPolicy = Literal["held", "free"]


class Beside:
    """Robots of a process, and the time at which the stops of all of them were last checked, in any robot's turn.

    Attributes:
        robots: All of them.
        at_s: Time at which their stops are due again (monotonic); never for a single robot, which checks its own.
    """

    def __init__(self, robots: Sequence[RobotProcess]) -> None:
        self.robots = robots
        self._every_s = BESIDE_EVERY_S * max(1.0, len(robots) / ROBOTS_A_TICK) if len(robots) > 1 else math.inf
        self.at_s = 0.0

    def due(self, now_s: float) -> Sequence[RobotProcess]:
        """Return the robots whose stops are to be checked at a wall time (s): all if they are due, else none."""
        if now_s < self.at_s:
            return ()
        self.at_s = now_s + self._every_s
        return self.robots


class RobotProcess:
    """The emulator on the bus; call `turn` in a loop, or `step` in that of a `RobotHost`.

    Attributes:
        beside: All robots of this process, whose stops are checked whenever this one's are.
    """

    def __init__(
        self,
        bus: Bus,
        health: HealthReporter,
        setup: Setup,
        outlet: RobotOutlet,
        *,
        speed: float,
        clock: ClockPolicy,
        journal: Journal | None = None,
    ) -> None:
        """Begin to serve; nothing moves before a command.

        Args:
            bus: Bus of the robot.
            health: Reporter of its diagnostics.
            setup: Robot and world.
            outlet: Receiver of its telemetry.
            speed: Sim time per wall time: N is N× real time, 0 holds, negative is as fast as possible.
            clock: "held": sim time passes only while a traversal is under way or coming to rest; "free": always.
            journal: Journal of its progress, if one is kept.
        """
        self.beside = Beside((self,))
        ask = Lockstep(bus, self._stop_waits)
        self._emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard, ask=ask)
        self._telemetry = Telemetry(self._emulator, report_at_once=False)
        self._reporting = ThreadPoolExecutor(1, "report")
        self._report: Future[Reports] | None = None
        self._runner = FastRunner(self._emulator)
        self._pacer, self._stride = Pacer(speed, time.monotonic()), 1
        self._free = clock == "free"
        self._link = LinkWatch(bus, setup.onboard.link_timeout_s)
        self._rate = RateMeter()
        self._watchdog = Watchdog()
        self._outlet = outlet
        self._guided = GuidedLink(bus, self._emulator)
        guiding = Guiding(self._guided.knows, self._begin_guided, self._guided.set_owner)
        self._commands = Commands(self._emulator, self._telemetry, self._set_speed, journal, guiding)
        latch = LatchGuard()
        handlers = self._commands.handlers
        handlers[topics.ESTOP] = latch.stop(handlers[topics.ESTOP])
        handlers[topics.RESET] = latch.reset(handlers[topics.RESET])
        self._loader = Loader()
        self._goal_way = GoalWayService(
            bus, self._emulator, self._commands, lambda: self._hurries, self._awaits_load, self._publish_so_far
        )
        self._goals = Goals(bus, self._emulator, self._commands, self._loader.prepare, self._pace, self._goal_way)
        self._way_round = WayRoundService(
            bus, self._emulator, self._commands, lambda: self._link.attended, self._publish_so_far
        )
        self._commands.taken = self._note_taken
        for service in [service for service in handlers if service.urgent]:
            handlers[service] = self._cancelling(handlers[service], for_good=service != topics.PAUSE)
        served = [(bus.serve(service), handler) for service, handler in handlers.items()]
        self._stops = [(server, handler) for server, handler in served if server.service.urgent]
        self._others = [(server, handler) for server, handler in served if not server.service.urgent]
        self._loads = [bus.serve(service) for service in self._commands.loads]
        self._waiting: list[tuple[ServedCall[Any, Any], Handler]] = []
        self._namespace = bus.namespace
        self._health, self._published_state, self._health_at_s = health, -1, 0.0
        self._recorder_limit, self._held_at_s = RecorderLimit(bus), -math.inf
        self._tidy_at_s = time.monotonic()
        self._publish([self._telemetry.setup(), *self._telemetry.standing(), *self._telemetry.awake()])
        self._publish(self._commands.take())

    def take_ticks(self, stride: int) -> None:
        """Run ticks up to multiples of the stride, once they are due."""
        self._pacer.stride = self._stride = stride

    @property
    def active(self) -> bool:
        """True if a traversal is under way or coming to rest."""
        return self._emulator.active

    def turn(self) -> None:
        """Serve requests, run the ticks that are due (at most 10 ms of them), and sleep if there are none."""
        time.sleep(max(0.0, self.step(LONGEST_SLICE_S) - time.monotonic()))

    def step(self, slice_s: float) -> float:
        """Serve requests and run the ticks that are due; return the time (monotonic) until which nothing else is due.

        Args:
            slice_s: Approximate limit of the time for running ticks.
        """
        self._answer_all_stops(time.monotonic())
        self._mind_watchdog()
        self._serve()
        self._mind_report()
        self._mind_link()
        self._mind_outlet()
        now = time.monotonic()
        self._rate.note(now, self._emulator.tick_count)
        self._publish_health()
        if self._time_passes:
            if self._held_for_plan:
                pass
            elif self._held:
                self._held_at_s = now
            else:
                waits = self._run(self._pacer.due(now, self._emulator.tick_count), now + slice_s)
                now = time.monotonic()
                longest_s = max(self._idle_s, LONGEST_SLICE_S)
                return now + (HELD_S if waits else self._pacer.wait_s(now, longest_s))
        else:
            self._pacer.restart(now)
            self._tidy(now)
        return time.monotonic() + self._idle_s

    @property
    def _idle_s(self) -> float:
        """Time for which commands may wait: many robots serve theirs less often."""
        return min(max(IDLE_S, LOOK_S * len(self.beside.robots)), LATEST_LOOK_S)

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
    def _time_passes(self) -> bool:
        return self._free or self._emulator.active or self._goals.waking or self._guided.under_way

    def _pace(self) -> float:
        """Return sim time per wall time."""
        return self._pacer.factor if self._pacer.factor >= 0.0 else self._rate.real_time_factor

    @property
    def _held(self) -> bool:
        """True if sim time stands still until the telemetry so far is taken; never while the robot is to stop.

        At real time or slower sim time is never held: an operator would see a robot that stands although it drives.
        """
        if not (self._hurries and self._running):
            return False
        return self._outlet.behind or self._recorder_limit.passed(self._emulator.time_s)

    @property
    def _hurries(self) -> bool:
        return self._pacer.factor < 0.0 or self._pacer.factor > 1.0

    @property
    def _held_for_plan(self) -> bool:
        """True if sim time stands still for a plan round things, which takes wall-clock time."""
        return self._hurries and (self._way_round.plans or self._goal_way.plans)

    def _awaits_load(self) -> bool:
        """Return whether somebody has given the robot a goal or a plan that it has not taken yet."""
        return self._goals.pending or not self._loader.idle

    def _note_taken(self, ready: Ready) -> None:
        self._goal_way.taken()
        self._way_round.begin(ready)

    @property
    def _held_back(self) -> bool:
        """True if sim time was held recently."""
        return time.monotonic() - self._held_at_s < HELD_BACK_S

    def _begin_guided(self, coordinator: str, lockstep_s: float) -> None:
        self._guided.begin(coordinator, lockstep_s)
        self._pacer.forgiven_s = IN_STEP_FORGIVEN_S if lockstep_s else FORGIVEN_S
        self._pacer.stride = 2 * self._stride if lockstep_s else self._stride  # nobody waits for messages in between

    def _run(self, ticks: int, until_s: float) -> bool:
        """Run ticks, until about a wall time (s); return True if sim time waits for a coordinator's answer."""
        waits = False
        while ticks > 0 and self._time_passes:
            if waits := self._guided.held(time.monotonic(), hurries=self._pacer.factor < 0.0):
                self._pacer.give_back(ticks)
                break
            most = min(ticks, self._guided.ticks_ahead())
            rows = self._telemetry.rows
            done = self._runner.step(self._telemetry.until_due(most), rows)
            news = self._commands.note_progress()
            self._telemetry.hold(done)
            news += self._guided.drove(rows[:done])
            if news or self._telemetry.full or self._emulator.settled:
                self._publish_held()
                self._publish(news)
            self._way_round.look()
            self._goal_way.look()
            ticks -= done
            now = time.monotonic()
            self._answer_all_stops(now)
            if now >= until_s or self._held_for_plan:
                self._pacer.give_back(ticks)
                break
        self._publish_held()
        return waits

    def _publish_held(self) -> None:
        """Publish the messages that were due in the ticks since the last time, all at once."""
        self._publish(self._telemetry.told())

    def _publish_so_far(self) -> None:
        """Publish what is held and what the handlers have to publish."""
        self._publish_held()
        self._publish(self._commands.take())

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
        self._goals.turn()
        self._way_round.turn()
        self._goal_way.turn()
        for news in self._guided.turn(time.monotonic()):
            self._commands.report(*news)
        self._publish(self._commands.take())
        while self._telemetry.ended is None and (prepared := self._loader.poll()) is not None:
            self._end_load(prepared)

    def _begin_load(self, call: ServedCall[Any, Any], server: Server[Any, Any]) -> None:
        """Have a load prepared, unless it would be refused whatever is in it: then it is not even read."""
        load = self._commands.loads[server.service]
        if problem := self._commands.check_load(len(call.payload)):
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
            self._rate = RateMeter()  # a resumed job sets the clock
            self._publish(self._commands.take())
            if response is not None:
                call.reply(response)

    def _answer(self, call: ServedCall[Any, Any], handler: Handler) -> None:
        response = handler(call.request)
        self._publish(self._commands.take())
        call.reply(response)

    def _cancelling(self, handler: Handler, *, for_good: bool) -> Handler:
        """Wrap a handler that stops the robot, so that no earlier goal and no way round sets it in motion afterwards.

        Args:
            handler: The handler.
            for_good: True unless the robot can resume its drive.
        """

        def handle(request: Any) -> Message:
            response = handler(request)
            self._goals.cancel()
            if self._way_round.stop(for_good=for_good) or self._goal_way.stop(for_good=for_good):
                return m.CommandResponse(success=True, message="the robot stands, and its job ends here")
            return response

        return handle

    def _stop_waits(self) -> bool:
        """Return True if a stop is requested; in the middle of a tick, so it is answered after that."""
        for server, handler in self._stops:
            for _ in range(SERVED_AT_ONCE):
                if (call := server.poll()) is None:
                    break
                self._waiting.append((call, handler))
        return bool(self._waiting)

    def _answer_all_stops(self, now_s: float) -> None:
        """Answer the stops of this robot, and at intervals those of the others in this process."""
        self.answer_stops()
        for robot in self.beside.due(now_s):
            robot.answer_stops()

    def answer_stops(self) -> None:
        """Carry out the stops of this robot; between ticks only."""
        self._stop_waits()
        waiting, self._waiting = self._waiting, []
        if waiting:
            self._publish_held()
        for call, handler in waiting:
            self._answer(call, handler)

    def _publish_health(self) -> None:
        """Publish the diagnostics, a new state at once: on a session of its own, should the telemetry be held up."""
        state, now_s = self._emulator.onboard.state, time.monotonic()
        changed, self._published_state = state != self._published_state, state
        if not changed and now_s < self._health_at_s:
            return
        self._health_at_s = now_s + HEALTH_EVERY_S
        if changed:
            reason = self._emulator.onboard.status.reason
            _LOG.info("%s: %s%s", self._namespace, NAMES[state], f": {reason}" if reason else "")
        if not (changed or self._health.due):
            return
        slow = "sim time is held back: the telemetry is not taken as fast as it comes" if self._held_back else "ok"
        message = self._emulator.onboard.status.reason or slow
        self._health.poll(self._diagnostics(), message=message, at_once=changed)

    def _mind_report(self) -> None:
        """Have the report of an ended traversal made in a thread, and publish it; nothing is loaded before."""
        if self._telemetry.ended is None:
            return
        if self._report is None:
            self._report = self._reporting.submit(self._telemetry.ended.final_reports)
        elif self._report.done():
            self._publish(self._telemetry.conclude(self._report.result()))
            self._report = None

    def _mind_link(self) -> None:
        if not self._link.lost(self._running, time.monotonic()):
            return
        self._commands.link_lost()
        self._publish(self._commands.take())

    def _mind_watchdog(self) -> None:
        missed_s = self._watchdog.missed_s(time.monotonic())
        if missed_s > WATCHDOG_S and self._running and 0.0 < self._pacer.factor <= 1.0 and not self._guided.in_step:
            self._commands.fail_safe(missed_s)
            self._publish(self._commands.take())

    def _mind_outlet(self) -> None:
        if self._outlet.turn():
            self._publish(self._telemetry.all_paint())

    @property
    def at_rest(self) -> bool:
        """True if this robot can bear a pause of the process."""
        return self._loader.idle and not self._emulator.active

    def _tidy(self, now_s: float) -> None:
        robots = self.beside.robots
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
