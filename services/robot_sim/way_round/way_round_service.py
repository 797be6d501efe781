"""Ways round in the robot's process: the robot asks the planner for the rest of its job, and takes it where it stands.

It does so whoever has started the job: the console, the command line or ROS 2.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final

from touchline.bus import Bus
from touchline.bus.calls import Question
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused, PayloadError, SpecError
from touchline.schemas.plan_cause import PlanCause
from touchline.services.robot_sim.command_handlers import Commands, Ready
from touchline.services.robot_sim.emulator import UNDER_WAY, Emulator
from touchline.services.robot_sim.plan_answers import plan_response
from touchline.services.robot_sim.way_round.remains import Rest
from touchline.services.robot_sim.way_round.rest_request import RestRequest
from touchline.services.robot_sim.way_round.waiting import WaitingOrder
from touchline.services.robot_sim.way_round.way_round_job import RestDraft, WayRoundJob, goes_round

LOOK_TICKS: Final = 10
"""Ticks between two looks at what is in the way."""
PLAN_TIMEOUT_S: Final = 60.0


class WayRoundService:
    """Ways round of one robot; the loop calls `turn`, and `look` between ticks.

    Args:
        bus: Bus of the robot.
        emulator: The robot.
        commands: Handlers that take a trajectory.
        attended: Returns whether an operator could answer.
        publish: Publishes what happened up to now, before and after each report.
    """

    def __init__(
        self,
        bus: Bus,
        emulator: Emulator,
        commands: Commands,
        attended: Callable[[], bool],
        publish: Callable[[], None],
    ) -> None:
        self._bus, self._emulator, self._commands = bus, emulator, commands
        self._attended, self._publish = attended, publish
        self._servers = [
            (bus.serve(topics.WAIT_ON), WaitingOrder.WAIT),
            (bus.serve(topics.GO_ROUND), WaitingOrder.GO_ROUND),
            (bus.serve(topics.LEAVE_OUT), WaitingOrder.LEAVE_OUT),
        ]
        self._vehicle_json = emulator.vehicle.model_dump_json()
        self._preparing = ThreadPoolExecutor(1, "way-round")
        self._job: WayRoundJob | None = None
        self._driven, self._taking, self._look_tick = False, False, 0
        self._forget()

    def _forget(self) -> None:
        """Drop a plan in progress."""
        self._draft: tuple[RestDraft, Future[Rest | None]] | None = None
        self._request: RestRequest | None = None
        self._question: Question | None = None
        self._left_out: tuple[m.LeftOutStretch, ...] = ()
        self._prepared: Future[Ready] | None = None
        self._ready: Ready | None = None

    @property
    def plans(self) -> bool:
        """True while a plan is being drafted, made or prepared."""
        return self._draft is not None or self._question is not None or self._prepared is not None

    def begin(self, ready: Ready) -> None:
        """Note that the robot has taken a trajectory: the next drive of this job, or another job."""
        self._driven = False
        if self._taking and self._job is not None:
            self._job.drives_on(ready.trajectory)
            return
        self._forget()
        self._job = None
        if ready.template is not None and goes_round(self._emulator.vehicle, ready.template):
            cause = ready.job.cause or PlanCause()
            self._job = WayRoundJob(self._emulator, ready.template, ready.trajectory, cause, self._told)

    def stop(self, *, for_good: bool) -> bool:
        """Note that a person has ordered the robot to stop; return True if it was between two drives.

        Args:
            for_good: True unless the robot can resume its drive.
        """
        standing = self._emulator.onboard.state not in UNDER_WAY
        between = self._job is not None and (self._job.between_drives or (self.plans and standing))
        self._forget()
        if self._job is not None and (between or for_good):
            self._job.cancel()
        return between

    def turn(self) -> None:
        """Serve answers of operators, and go on with a plan."""
        for server, order in self._servers:
            if (call := server.poll()) is not None:
                problem = self._job.answer(order) if self._job is not None else "the robot goes round nothing"
                call.reply(m.CommandResponse(success=not problem, message=problem or "done"))
        job = self._job
        if job is None or job.over:
            return
        if self._draft is not None:
            self._take_draft(job, *self._draft)
        elif self._question is not None:
            self._poll_planner(job, self._question)
        elif self._prepared is not None:
            if self._prepared.done():
                self._take_prepared(job, self._prepared)
        elif self._ready is not None:
            if not self._emulator.active and self._commands.concluded:
                self._set_off(job, self._ready)
        elif job.between_drives:
            if job.may_search:  # the robot has not taken the last plan
                self._begin_draft(job)
        elif self._driven and not self._emulator.active and self._commands.concluded:
            self._driven = False
            if (draft := job.drive_ends()) is not None:
                self._draft = draft, self._preparing.submit(draft.rest)

    def look(self) -> None:
        """Look at what is in the way, between ticks."""
        job = self._job
        if job is None or job.over or not self._emulator.active or self._emulator.tick_count < self._look_tick:
            return
        self._driven, self._look_tick = True, self._emulator.tick_count + LOOK_TICKS
        if self._ready is not None or not job.look(attended=self._attended()) or self.plans:
            return
        self._begin_draft(job)

    def _begin_draft(self, job: WayRoundJob) -> None:
        """Have the rest worked out in a thread: of a large area it takes up to a second, and stops cannot wait."""
        if (draft := job.draft()) is not None:
            self._draft = draft, self._preparing.submit(draft.rest)
        else:
            self._leave_rest(job)

    def _take_draft(self, job: WayRoundJob, draft: RestDraft, rest: Future[Rest | None]) -> None:
        """Ask for the plan of a rest that is worked out, unless the way has become free meanwhile."""
        if not rest.done():
            return
        self._draft = None
        if self._emulator.onboard.state in UNDER_WAY and not job.waits:
            return
        if (request := job.request(draft, rest.result())) is not None:
            self._ask(request)
        else:
            self._leave_rest(job)

    def _leave_rest(self, job: WayRoundJob) -> None:
        if (why := job.nothing_remains()) and self._emulator.onboard.state in UNDER_WAY:
            self._abort(why)

    def _ask(self, request: RestRequest) -> None:
        """Call the planner."""
        plan = m.PlanRequest(
            request_id=uuid.uuid4().hex,
            template_json=request.template.to_json(),
            vehicle_json=self._vehicle_json,
            options=request.options,
            remaining_json=request.remaining_json,
        )
        self._request = request
        self._question = self._bus.ask(topics.PLAN_SERVICE, encode(plan), PLAN_TIMEOUT_S)

    def _poll_planner(self, job: WayRoundJob, question: Question) -> None:
        answer = question.poll()
        if answer is None:
            return
        self._question, request = None, self._request
        assert request is not None, "it was asked for"
        planned = plan_response(answer)
        if isinstance(planned, str):
            self._fail(job, planned, searched=False)
            return
        if not planned.success:
            self._fail(job, planned.message, nothing_reached=planned.nothing_reached)
            return
        self._left_out = planned.report.left_out
        load = m.LoadRequest(
            trajectory=planned.trajectory,
            template_json=request.rest.template.to_json(),
            here=True,
            cause_json=request.cause(planned.report).model_dump_json(),
        )
        self._prepared = self._preparing.submit(self._commands.prepare_load, load)

    def _take_prepared(self, job: WayRoundJob, prepared: Future[Ready]) -> None:
        """End the present drive for the plan, unless the way has become free meanwhile."""
        request, self._prepared = self._request, None
        assert request is not None, "it was planned"
        try:
            ready = prepared.result()
        except (CommandRefused, PayloadError, SpecError) as error:
            self._fail(job, str(error))
            return
        if self._emulator.onboard.state in UNDER_WAY:
            if not job.waits:
                self._forget()
                return
            self._abort(job.breaks_off(request, ready.trajectory, self._left_out))
        else:
            job.returns(request, ready.trajectory, self._left_out)
        self._ready = ready

    def _set_off(self, job: WayRoundJob, ready: Ready) -> None:
        """Take the plan where the robot stands, and start."""
        self._forget()
        self._taking = True
        try:
            self._commands.take_job(ready)
            self._emulator.start()
        except CommandRefused as error:
            self._fail(job, str(error))
        finally:
            self._taking = False
        self._told()

    def _fail(self, job: WayRoundJob, reason: str, *, searched: bool = True, nothing_reached: bool = False) -> None:
        self._forget()
        why = job.finds_no_way(reason, searched=searched, nothing_reached=nothing_reached)
        if why and self._emulator.onboard.state in UNDER_WAY:
            self._abort(why)

    def _abort(self, why: str) -> None:
        self._publish()
        self._emulator.abort(why)
        self._told()

    def _told(self) -> None:
        """Publish the changes that a report or an order has made."""
        self._publish()
        self._commands.report_changes()
        self._publish()
