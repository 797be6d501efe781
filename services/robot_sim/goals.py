"""Goals: the robot requests a path from its place, at rest or while driving, and sets off or continues on it.

The rule is the same for the console, the command line and ROS 2: they all call the service `traversal/goto`.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from touchline.bus import Bus, ServedCall
from touchline.bus.calls import Question
from touchline.onboard.executive.handover import NotYet
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import CommandRefused, PayloadError, SpecError
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.path_start import PathStart, hindrance
from touchline.schemas.plan_cause import LeftDrive, PlanCause
from touchline.schemas.spec import parse
from touchline.services.robot_sim.command_handlers import Commands, Load, Ready
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.goal_way.goal_service import GoalWayService
from touchline.services.robot_sim.plan_answers import NO_PLANNER

PATIENCE_S: Final = 10.0
"""Wall-clock time to wait until the robot knows its place, rests, or can be taken over."""
PLAN_TIMEOUT_S: Final = 60.0
RETRY_S: Final = 0.1
ARRIVING_S: Final = 0.5
"""Sim time: a robot that arrives within it counts as arrived."""
LAST_M: Final = 1e-6
"""Remaining distance below which the robot turns on the spot, or is about to rest."""
_LOST: Final = "the robot does not find out where it stands; does sim time pass, has it a fix?"
ANOTHER_GOAL: Final = "another goal has come"
_STOPPED: Final = "the robot was told to stop meanwhile; send the goal again"

GoalCall = ServedCall[m.GotoRequest, m.GotoResponse]


@dataclass
class AskedGoal:
    """A goal that has not been answered yet.

    Attributes:
        call: Call to answer.
        since_s: Time of its arrival.
        stops: Number of stop orders to the robot by then.
        retry_s: Time before which it is not handled again.
        question: Call of the planner, if one is pending.
        under_way: True if the path begins on a path that is being driven.
        reason: Reason why it has not been answered.
        cause_json: Request that the path is made from.
    """

    call: GoalCall
    since_s: float
    stops: int
    retry_s: float = 0.0
    question: Question | None = None
    under_way: bool = False
    reason: str = ""
    cause_json: str = ""


class Goals:
    """Goals of one robot; of several at once the newest counts.

    Args:
        bus: Bus of the robot.
        emulator: The robot.
        commands: Handlers that take a trajectory.
        prepare: Prepares a load in a thread of its own.
        pace: Sim time per wall time.
        ways: Ways round what is seen on the way to a goal.
    """

    def __init__(
        self,
        bus: Bus,
        emulator: Emulator,
        commands: Commands,
        prepare: Callable[[ServedCall[Any, Any], Load], None],
        pace: Callable[[], float],
        ways: GoalWayService,
    ) -> None:
        self._bus, self._emulator, self._commands = bus, emulator, commands
        self._prepare, self._pace, self._ways = prepare, pace, ways
        self._server = bus.serve(topics.GOTO)
        self._asked: AskedGoal | None = None
        self._stops = 0
        self._vehicle_json = emulator.vehicle.model_dump_json()

    @property
    def waking(self) -> bool:
        """True if sim time has to pass for the robot to find its place."""
        return self._asked is not None and not self._emulator.active and not self._emulator.onboard.aligned

    @property
    def pending(self) -> bool:
        """True while a goal has not been answered yet."""
        return self._asked is not None

    def cancel(self) -> None:
        """Drop a goal because the robot was ordered to stop: no earlier goal sets it in motion."""
        self._stops += 1
        if self._asked is not None:
            asked, self._asked = self._asked, None
            self._refuse(asked.call, _STOPPED)

    def turn(self) -> None:
        """Receive goals, and handle the present one."""
        now_s = time.monotonic()
        if (call := self._server.poll()) is not None:
            if self._asked is not None:
                self._refuse(self._asked.call, "another goal has come since")
            self._asked = AskedGoal(call, now_s, self._stops)
        asked = self._asked
        if asked is None or now_s < asked.retry_s:
            return
        try:
            if asked.question is None:
                self._ask(asked, now_s)
            else:
                self._look(asked, asked.question, now_s)
        except (CommandRefused, PayloadError, SpecError) as error:
            self._asked = None
            self._refuse(asked.call, str(error))

    def _ask(self, asked: AskedGoal, now_s: float) -> None:
        """Call the planner, once the robot is where a path can begin.

        Raises:
            CommandRefused: Waiting for that is over or pointless.
        """
        emulator, request = self._emulator, asked.call.request
        if len(request.options.start):
            raise CommandRefused("the goal has options.start, but the robot begins where it is: leave it empty")
        start = self._path_start()
        if start.state == m.TraversalStatus.PAUSED and self._ways.give_way(ANOTHER_GOAL):
            start = self._path_start()
        if problem := hindrance(start.state):
            raise CommandRefused(f"cannot go to a goal while {problem}")
        asked.under_way = start.under_way
        if asked.under_way or (emulator.onboard.aligned and not emulator.active):
            ground_json = request.ground_json
            plan = start.request(request.goal, request.options, self._vehicle_json, uuid.uuid4().hex, ground_json)
            ground = parse(KnownGround, ground_json, "ground_json") if ground_json else OPEN_GROUND
            left = next(iter(plan.leaving), None)
            leaves = None if left is None else LeftDrive.of(left)
            cause = PlanCause(
                options=plan.options, goal=request.goal, ground=ground, leaves=leaves, known=ground.obstacles
            )
            asked.cause_json = cause.model_dump_json()
            asked.question = self._bus.ask(topics.PLAN_SERVICE, encode(plan), PLAN_TIMEOUT_S)
            return
        asked.reason = asked.reason or _LOST
        self._wait(asked, now_s)

    def _path_start(self) -> PathStart:
        """Return the present state of the robot."""
        onboard = self._emulator.onboard
        pose = onboard.estimate[:3] if onboard.aligned else ()
        at_m = onboard.status.arc_length_m
        return PathStart(onboard.state, pose, self._commands.trajectory, at_m, self._pace())

    def _look(self, asked: AskedGoal, question: Question, now_s: float) -> None:
        """Handle the planner's answer.

        Raises:
            CommandRefused, PayloadError: There is none, or no plan.
        """
        answer = question.poll()
        if answer is None:
            return
        asked.question = None
        if answer.refusal is not None:
            raise CommandRefused(f"no way is planned: {answer.refusal}")
        if answer.payload is None:
            asked.reason = NO_PLANNER
            self._wait(asked, now_s)
            return
        planned = decode(m.PlanResponse, answer.payload)
        if not planned.success and asked.under_way and self._arriving:
            asked.reason = planned.message  # the rest of the path may be too short: plan from its end
            self._wait(asked, now_s)
            return
        if not planned.success:
            raise CommandRefused(planned.message)
        self._asked = None
        under_way = asked.under_way
        load = m.LoadRequest(
            trajectory=planned.trajectory, here=not under_way, replace=under_way, cause_json=asked.cause_json
        )
        self._prepare(
            asked.call,
            Load(
                lambda _request: self._commands.prepare_load(load),
                lambda ready: self._go(ready, asked, planned.message),
                self._refusal,
            ),
        )

    @property
    def _arriving(self) -> bool:
        status = self._emulator.onboard.status
        return status.remaining_s < ARRIVING_S or status.arc_length_m > status.total_length_m - LAST_M

    def _go(self, ready: Ready, asked: AskedGoal, message: str) -> m.GotoResponse | None:
        """Take the prepared path and set off; return None if that has to be tried again."""
        if asked.stops != self._stops:
            return self._refusal(_STOPPED)
        try:
            total_time_s = self._commands.take_job(ready)
            if not asked.under_way:
                self._emulator.start()
        except CommandRefused as error:
            ended = self._emulator.onboard.state != m.TraversalStatus.RUNNING
            passing = isinstance(error, NotYet) or (asked.under_way and ended)
            if not passing or self._asked is not None or time.monotonic() > asked.since_s + PATIENCE_S:
                return self._refusal(str(error))
            asked.reason, asked.retry_s = str(error), time.monotonic() + RETRY_S
            self._asked = asked
            return None
        self._commands.report(m.Event.INFO, "goal", message)
        self._commands.report_changes()
        self._ways.begin(asked.call.request, ready.trajectory)
        return m.GotoResponse(success=True, message=message, total_time=total_time_s)

    def _wait(self, asked: AskedGoal, now_s: float) -> None:
        """Handle the goal again in a moment.

        Raises:
            CommandRefused: It has waited long enough.
        """
        if now_s > asked.since_s + PATIENCE_S:
            raise CommandRefused(asked.reason)
        asked.retry_s = now_s + RETRY_S

    def _refuse(self, call: GoalCall, reason: str) -> None:
        call.reply(self._refusal(reason))

    def _refusal(self, reason: str) -> m.GotoResponse:
        """Return the answer to a refused goal; its sender may not receive it, so the event log has it, too."""
        self._commands.report(m.Event.ERROR, "goal-refused", f"the goal is refused: {reason}")
        return m.GotoResponse(success=False, message=reason)
