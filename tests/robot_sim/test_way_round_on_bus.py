"""Ways round in the robot's process: it asks the planner by itself, and people can answer it or stop it."""

from contextlib import ExitStack
from functools import cache

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import AtOnce, ask, turn_until
from tests.way_round.met import FIELD, MARKER, PERSON, meeting
from touchline.bus import Bus, HealthReporter
from touchline.jobs.single.simulation import Job
from touchline.schemas import topics
from touchline.schemas.messages import Event, PlanOptions, TraversalReport, TraversalStatus, WayRound
from touchline.schemas.plan_cause import PlanCause
from touchline.services.planner.request import answer
from touchline.services.robot_sim.robot_process import RobotProcess

pytestmark = pytest.mark.xdist_group("way round on bus")  # by one worker, so that the job is planned once


@cache
def job():
    return Job.prepare(FIELD, PlanOptions(), MARKER)


class Meeting:
    """The robot, a planner that can be away, and what an operator hears."""

    def __init__(self, bus, bus_config, operator):
        self._config, self._planner, self._server = bus_config, ExitStack(), None
        self.robot = RobotProcess(
            bus, HealthReporter(bus), meeting(PERSON), AtOnce(bus), speed=-1.0, clock="held", journal=None
        )
        self._inbox = operator.inbox([topics.EVENTS, topics.WAY_ROUND, topics.STATUS, topics.REPORT])
        self.said, self.status = WayRound(), TraversalStatus()
        self.states, self.events, self.reports = [], [], []

    def plan(self, *, there):
        """Bring the planner, or take it away."""
        self._server = None
        self._planner.close()
        if there:
            planner = self._planner.enter_context(Bus.open(topics.PLANNER, self._config))
            self._server = planner.serve(topics.PLAN_SERVICE)

    def turn(self):
        self.robot.turn()
        if self._server is not None and (call := self._server.poll()) is not None:
            call.reply(answer(call.request, MARKER))
        for _, message in self._inbox.messages():
            if isinstance(message, WayRound):
                self.said = message
                self.states.append(message.state)
            elif isinstance(message, TraversalStatus):
                self.status = message
            elif isinstance(message, Event):
                self.events.append(message)
            elif isinstance(message, TraversalReport):
                self.reports.append(message)

    def until(self, state):
        turn_until(self, lambda: self.said.state == state)


@pytest.fixture
def met(bus, bus_config, operator):
    """The robot, which has set off towards the person."""
    found = Meeting(bus, bus_config, operator)
    caught_up(bus, operator)
    cause = PlanCause.of(job().options, job().plan_report).model_dump_json()
    load = {"trajectory": job().trajectory, "template_json": FIELD.to_json(), "cause_json": cause}
    assert ask(operator, found, topics.LOAD, **load).success
    refused = ask(operator, found, topics.GO_ROUND)
    assert not refused.success and refused.message == "the robot does not wait before anything"
    assert ask(operator, found, topics.START).success
    yield found
    found.plan(there=False)


def test_it_waits_for_a_planner_and_does_the_whole_job_by_itself(met):
    met.until(WayRound.FINDS_NO_WAY)
    assert any("no planner answers" in each.text for each in met.events)
    assert not met.said.continues
    met.plan(there=True)
    turn_until(
        met,
        lambda: len(met.reports) == met.said.drives > 2 and not met.said.continues and not met.robot.active,
    )
    assert [each.text for each in met.events if "goes round" in each.text], "it says why it ends a drive"
    (gap,) = met.said.left_out
    assert gap.line_id == "s0" and gap.from_m < 6.0 < gap.to_m and gap.outline
    assert {WayRound.WAITS, WayRound.PLANS, WayRound.DRIVES} <= set(met.states)


def test_an_operator_is_asked_first_and_can_order_it_to_go_round_or_to_wait(met, operator):
    met.plan(there=True)
    met.until(WayRound.WAITS)
    waits_s = met.said.goes_round_at.seconds - met.said.header.stamp.seconds
    assert 10.0 < waits_s < 15.1 and len(met.said.things) == 1 and met.said.drives == 1
    assert ask(operator, met, topics.WAIT_ON).success
    turn_until(met, lambda: met.said.goes_round_at.seconds == 0.0)
    later_s = met.said.header.stamp.seconds + 20.0
    turn_until(met, lambda: met.status.header.stamp.seconds > later_s)
    assert met.said.drives == 1, "it waits on"
    assert ask(operator, met, topics.LEAVE_OUT).success
    turn_until(met, lambda: met.said.drives == 2)
    assert [gap.outline for gap in met.said.left_out] == ["operator"] and not met.said.continues


def test_a_pause_ends_the_search_and_an_abort_the_job(met, operator):
    met.until(WayRound.WAITS)
    assert ask(operator, met, topics.PAUSE).success
    turn_until(met, lambda: met.said.state == WayRound.DRIVES)
    assert not ask(operator, met, topics.GO_ROUND).success
    assert ask(operator, met, topics.ABORT).success
    turn_until(met, lambda: met.reports and not met.robot.active)
    assert not met.said.continues and met.said.drives == 1
    assert met.status.state == TraversalStatus.ABORTED
