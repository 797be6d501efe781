"""Drives to goals in the robot's process: the planner is asked for other ways while the robot goes on."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final, TypeAlias

from touchline.bus import Bus
from touchline.bus.calls import Question
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas import messages as m
from touchline.schemas import path_start, topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused, PayloadError, SpecError
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.spec import parse
from touchline.services.robot_sim.command_handlers import Commands, Ready
from touchline.services.robot_sim.emulator import UNDER_WAY, Emulator
from touchline.services.robot_sim.goal_way.goal_pursuit import KEEP_S, GoalPursuit
from touchline.services.robot_sim.goal_way.seen_ground import SeenGround
from touchline.services.robot_sim.goal_way.way_request import ChosenWay, PlannedWay, Planning, WayRequest
from touchline.services.robot_sim.plan_answers import plan_response
from touchline.services.robot_sim.way_round.seen_things import seen_things, thing_in_the_way

LOOK_TICKS: Final = 10
"""Ticks between two looks at what the lidars see."""
PLAN_TIMEOUT_S: Final = 60.0
PROOF_TIMEOUT_S: Final = 300.0
"""The same, if it is to be proved that there is no way."""
SPARE_S: Final = 0.5
"""Sim time for which a driving robot keeps its way, besides the time that the last plan under way took."""
AGAIN_S: Final = 5.0
"""Sim time after which a planner that has not answered is asked again."""

Choice: TypeAlias = Planning[str | ChosenWay | None]


class GoalWayService:
    """Ways of one robot to goals; the loop calls `turn`, and `look` between ticks.

    Args:
        bus: Bus of the robot.
        emulator: The robot.
        commands: Handlers that take a trajectory.
        held: Returns whether sim time is held while a plan is made.
        awaited: Returns whether somebody has given the robot another goal or plan, which comes first.
        publish: Publishes what happened up to now, before and after each report.
    """

    def __init__(
        self,
        bus: Bus,
        emulator: Emulator,
        commands: Commands,
        held: Callable[[], bool],
        awaited: Callable[[], bool],
        publish: Callable[[], None],
    ) -> None:
        self._bus, self._emulator, self._commands = bus, emulator, commands
        self._held, self._awaited, self._publish = held, awaited, publish
        self._vehicle_json = emulator.vehicle.model_dump_json()
        self._preparing = ThreadPoolExecutor(1, "goal-way")
        self._job: GoalPursuit | None = None
        self._seen: SeenGround | None = None
        self._driven, self._taking, self._look_tick = False, False, 0
        self._search_tick, self._keep_s = 0, path_start.KEEP_S
        self._drives, self._said, self._warned = 0, m.WayRound(), ""
        self._drop_plan()

    def _drop_plan(self) -> None:
        """Drop a plan in progress."""
        self._planning: Choice | None = None
        self._packed: tuple[Future[bytes], float] | None = None
        self._question: Question | None = None
        self._prepared: Future[Ready] | None = None
        self._ready: Ready | None = None
        self._takes_over = self._has_asked = False
        self._why = ""

    @property
    def plans(self) -> bool:
        """True while a plan is being made or prepared."""
        return self._packed is not None or self._question is not None or self._prepared is not None

    @property
    def _standing(self) -> bool:
        """True between two drives."""
        return self._emulator.onboard.state not in UNDER_WAY

    def begin(self, request: m.GotoRequest, trajectory: m.Trajectory) -> None:
        """Note that the robot has set off to a goal.

        Args:
            request: The goal.
            trajectory: The first way.
        """
        if self._emulator.onboard.perception is None:
            return
        ground = parse(KnownGround, request.ground_json, "ground_json") if request.ground_json else OPEN_GROUND
        if self._seen is None or self._seen.known != ground:
            self._seen = SeenGround(ground)
        self._job = GoalPursuit(self._emulator, request.goal, request.options, self._seen)
        self._job.begins(trajectory)
        self._drives, self._said, self._warned = 1, m.WayRound(), ""
        self._say(m.WayRound.DRIVES)

    def taken(self) -> None:
        """Note that the robot has taken a trajectory: unless it was one from here, the drive to the goal is over."""
        if not self._taking:
            self._end()

    def give_way(self, reason: str) -> bool:
        """End a drive to a goal that waits for something in the way, for another one; return False if there is none.

        Args:
            reason: Reason to abort it with.
        """
        pause = self._emulator.onboard.status.pause
        if self._job is None or pause is None or pause.cause != m.PauseStatus.IN_THE_WAY or not pause.ends_by_itself:
            return False
        self._abort(reason)
        self._end()
        return True

    def stop(self, *, for_good: bool) -> bool:
        """Note that a person has ordered the robot to stop; return True if it was between two drives.

        Args:
            for_good: True unless the robot can resume its drive.
        """
        if self._job is None:
            return False
        between = self._standing and (self.plans or self._ready is not None or self._job.continues)
        if between or for_good:
            self._end()
        elif self.plans:
            self._give_up_plan(self._job)
        return between

    def look(self) -> None:
        """Look at what the lidars see, between ticks."""
        job, emulator = self._job, self._emulator
        if job is None or self._standing or emulator.tick_count < self._look_tick:
            return
        self._driven, self._look_tick = True, emulator.tick_count + LOOK_TICKS
        job.look()
        pause = emulator.onboard.status.pause
        if self.plans and not self._takes_over and job.has_left:  # its way has become free meanwhile
            self._give_up_plan(job)
        if self._said.state == m.WayRound.FINDS_NO_WAY and pause is None and not job.stands:
            self._say(m.WayRound.DRIVES, continues=job.continues)
        if pause is not None and not pause.ends_by_itself:
            job.waits(0)
        elif not (self.plans or self._ready is not None or self._awaited()):
            self._advance(job, job.stops())
            if not (self.plans or self._ready is not None or self._standing):
                self._takes_over, self._search_tick = True, emulator.tick_count
                job.keep_s = KEEP_S if self._held() else self._keep_s
                self._advance(job, job.replaces())

    def turn(self) -> None:
        """Go on with a plan, and with the next drive."""
        job = self._job
        if job is None:
            return
        if self._awaited():
            if self.plans and not self._standing:
                self._give_up_plan(job)
        elif self._packed is not None:
            packed, timeout_s = self._packed
            if packed.done():
                self._packed = None
                self._question = self._bus.ask(topics.PLAN_SERVICE, packed.result(), timeout_s)
        elif self._question is not None:
            self._poll_planner(job, self._question)
        elif self._prepared is not None:
            if self._prepared.done():
                self._take_prepared(job, self._prepared)
        elif self._emulator.active or not self._commands.concluded:
            pass
        elif self._ready is not None:
            self._set_off(job, self._ready)
        elif self._driven:
            self._driven = False
            done = self._emulator.onboard.state == m.TraversalStatus.DONE
            if done and (following := job.next_way()) is not None:
                self._prepare(following)
            else:
                self._end()

    def _advance(self, job: GoalPursuit, planning: Choice, answer: PlannedWay | str | None = None) -> None:
        """Go on with a choice of a way, up to its next request for a plan or its end.

        Args:
            job: The drive to the goal.
            planning: The choice.
            answer: Answer to its last request; None: it begins.
        """
        try:
            request = next(planning) if answer is None else planning.send(answer)
        except StopIteration as end:
            self._planning = None
            self._chosen(job, end.value)
        else:
            self._planning, self._has_asked = planning, True
            self._ask(request)

    def _ask(self, request: WayRequest) -> None:
        """Call the planner."""
        if not self._takes_over:
            self._say(m.WayRound.PLANS)
        timeout_s = PLAN_TIMEOUT_S if request.search.quick else PROOF_TIMEOUT_S
        self._packed = self._preparing.submit(self._pack, request), timeout_s

    def _pack(self, request: WayRequest) -> bytes:
        """Pack a request for the planner, in a thread of its own: outlines of all that was seen take a while."""
        plan = m.PlanRequest(
            request_id=uuid.uuid4().hex,
            vehicle_json=self._vehicle_json,
            options=request.options,
            goal=(request.goal,),
            leaving=() if request.leaving is None else (request.leaving,),
            ground_json="" if request.seen is None else request.ground.model_dump_json(),
            search=request.search,
        )
        return encode(plan)

    def _poll_planner(self, job: GoalPursuit, question: Question) -> None:
        answer = question.poll()
        if answer is None:
            return
        self._question, planning = None, self._planning
        assert planning is not None, "it has asked"
        planned = plan_response(answer)
        if isinstance(planned, str):
            self._fail(job, planned)
        elif planned.success:
            self._advance(job, planning, PlannedWay(planned.trajectory, planned.report.total_time_s))
        else:
            self._advance(job, planning, planned.message)

    def _chosen(self, job: GoalPursuit, choice: str | ChosenWay | None) -> None:
        """Prepare the chosen way; end the drive if there is none, and none will be."""
        asked, self._has_asked = self._has_asked, False
        if isinstance(choice, ChosenWay):
            self._prepare(choice)
        elif not choice:
            if asked and not self._takes_over:
                self._find_no_way(job.problem)
            self._takes_over = False
        elif not job.stands:  # its way has become free meanwhile
            self._give_up_plan(job)
        elif (following := job.next_way()) is not None:
            self._why = choice
            self._prepare(following)
        else:
            self._abort(choice)
            self._end()

    def _prepare(self, way: ChosenWay) -> None:
        load = m.LoadRequest(
            trajectory=way.trajectory,
            here=not self._takes_over,
            replace=self._takes_over,
            cause_json=way.cause.model_dump_json(),
        )
        self._prepared = self._preparing.submit(self._commands.prepare_load, load)

    def _take_prepared(self, job: GoalPursuit, prepared: Future[Ready]) -> None:
        """Take over under way; or end the present drive, unless its way has become free meanwhile."""
        self._prepared = None
        try:
            ready = prepared.result()
        except (CommandRefused, PayloadError, SpecError) as error:
            self._fail(job, str(error))
            return
        if self._takes_over:
            self._take_over(job, ready)
        elif self._standing:
            self._ready = ready
        elif job.stands:
            self._say(m.WayRound.PLANS, continues=True)
            self._abort(self._why)
            self._ready = ready
        else:
            self._give_up_plan(job)

    def _take_over(self, job: GoalPursuit, ready: Ready) -> None:
        took_s = (self._emulator.tick_count - self._search_tick) / TICKS_PER_S
        self._keep_s = min(took_s + SPARE_S, path_start.KEEP_S)
        if self._emulator.onboard.state == m.TraversalStatus.RUNNING:
            self._say(m.WayRound.PLANS, continues=True)
            if not self._take(ready):
                self._drive_on(job, ready)
                return
        self._give_up_plan(job)

    def _set_off(self, job: GoalPursuit, ready: Ready) -> None:
        """Take the plan where the robot stands, and start."""
        if problem := self._take(ready, start=True):
            self._end(f"does not go on to its goal: {problem}")
        else:
            self._drive_on(job, ready)

    def _take(self, ready: Ready, *, start: bool = False) -> str:
        """Take a plan; return why the robot does not."""
        self._taking = True
        try:
            self._commands.take_job(ready)
            if start:
                self._emulator.start()
                self._told()
        except CommandRefused as error:
            return str(error)
        finally:
            self._taking = False
        return ""

    def _drive_on(self, job: GoalPursuit, ready: Ready) -> None:
        self._drop_plan()
        self._driven, self._warned = False, ""
        job.begins(ready.trajectory)
        self._drives += 1
        self._say(m.WayRound.DRIVES, continues=job.continues)

    def _give_up_plan(self, job: GoalPursuit) -> None:
        """Drop a plan in progress; the robot drives or waits on."""
        self._drop_plan()
        job.stays()
        self._say(m.WayRound.DRIVES, continues=job.continues)

    def _fail(self, job: GoalPursuit, reason: str) -> None:
        """Wait, as no plan can be had, and try again later."""
        self._drop_plan()
        job.stays()
        job.waits(round(AGAIN_S * TICKS_PER_S))
        if self._standing:
            self._end(f"does not go on to its goal: {reason}")
        else:
            self._find_no_way(reason)

    def _find_no_way(self, reason: str) -> None:
        warning = f"finds no way round {self._in_the_way or 'what is in its way'}, and waits: {reason}"
        self._say(m.WayRound.FINDS_NO_WAY, warning="" if warning == self._warned else warning)
        self._warned = warning

    def _end(self, warning: str = "") -> None:
        """Note that the robot goes no further to its goal by itself."""
        if self._job is not None:
            self._job = None
            self._drop_plan()
            self._say(m.WayRound.DRIVES, warning=warning)

    def _abort(self, why: str) -> None:
        self._publish()
        self._emulator.abort(why)
        self._told()

    @property
    def _in_the_way(self) -> str:
        """Name of what is in the way; "" if nothing is."""
        onboard = self._emulator.onboard
        return thing_in_the_way(onboard, seen_things(onboard, ()))

    def _say(self, state: int, *, continues: bool = False, warning: str = "") -> None:
        """Report what the robot does, if that is new."""
        name = self._in_the_way if state != m.WayRound.DRIVES else ""
        said = m.WayRound(state=state, things=(name,) if name else (), continues=continues, drives=self._drives)
        if said != self._said or warning:
            self._said = said
            self._emulator.note_way_round(said, warning)
            self._told()

    def _told(self) -> None:
        """Publish the changes that a report or an order has made."""
        self._publish()
        self._commands.report_changes()
        self._publish()
