"""Drives to goals among unknown things in the robot's process: it asks the planner by itself, and can be stopped."""

import math
from contextlib import ExitStack

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import AtOnce, ask, turn_until
from tests.way_round.met import LIDAR
from tests.way_round.walls import wall
from touchline.bus import Bus, HealthReporter
from touchline.checking.check_files import check_file
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.schemas import topics
from touchline.schemas.messages import (
    ContactReport,
    Event,
    PlanResponse,
    PoseGoal,
    TraversalReport,
    TraversalStatus,
    WayRound,
)
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.request import answer
from touchline.services.robot_sim.robot_process import RobotProcess

GOAL = PoseGoal(x_m=8.0, y_m=0.0, heading_rad=math.nan)
SHORT_SIGHTED = {**LIDAR, "max_m": 4.0, "dark_m": 4.0}
VEHICLE = Vehicle.model_validate({"name": "marker", "sensors": [SHORT_SIGHTED], "protection": {"mode": "protect"}})
ACROSS = wall((4.0, -5.0), (4.0, 2.0))
ALL_ROUND = wall((-2.0, -3.0), (4.0, -3.0), (4.0, 3.0), (-2.0, 3.0), (-2.0, -3.0))


def at_once(request):
    return answer(request, VEHICLE)


class Recorded(AtOnce):
    """An outlet that records all that it publishes, too."""

    def __init__(self, bus, recorder):
        super().__init__(bus)
        self._recorder = recorder

    def send(self, payloads):
        super().send(payloads)
        self._recorder.hear("", payloads)


class Going:
    """The robot in a world with walls, a planner that can be slow or away, and what an operator hears."""

    def __init__(self, bus, bus_config, operator, walls, record=None):
        self._planner, self._config = ExitStack(), bus_config
        self._recording = PayloadRecorder(record)
        world = {"seed": 5, "start": {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}, "objects": walls}
        self.robot = RobotProcess(
            bus,
            HealthReporter(bus),
            Setup(vehicle=VEHICLE, scenario=Scenario.model_validate(world)),
            Recorded(bus, self._recording),
            speed=-1.0,
            clock="held",
            journal=None,
        )
        self._inbox = operator.inbox(
            [topics.EVENTS, topics.WAY_ROUND, topics.STATUS, topics.REPORT, topics.CONTACT_REPORT]
        )
        self.said, self.status, self.calls, self.answers = WayRound(), TraversalStatus(), [], at_once
        self.states, self.events, self.reports, self.contacts = [], [], [], []
        self.plan(there=True)
        caught_up(bus, operator)

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
            self.calls.append(call)
            if (response := self.answers(call.request)) is not None:
                call.reply(response)
        for _, message in self._inbox.messages():
            if isinstance(message, WayRound):
                self.said = message
                self.states.append(message.state)
            elif isinstance(message, TraversalStatus):
                self.status = message
            elif isinstance(message, Event):
                self.events.append(message)
            elif isinstance(message, ContactReport):
                self.contacts.append(message)
            elif isinstance(message, TraversalReport):
                self.reports.append(message)

    def until_over(self):
        turn_until(self, lambda: self.reports and not self.said.continues and not self.robot.active)

    def close(self):
        self.plan(there=False)
        self._recording.__exit__(None, None, None)

    @property
    def off_m(self):
        pose = self.robot._emulator.world.pose
        return math.hypot(pose.east_m - GOAL.x_m, pose.north_m - GOAL.y_m)


@pytest.fixture
def going(bus, bus_config, operator):
    """Make a robot among walls, which has set off to the goal."""
    made = []

    def make(walls, record=None, answers=at_once):
        found = Going(bus, bus_config, operator, walls, record)
        found.answers = answers
        made.append(found)
        told = ask(operator, found, topics.GOTO, goal=GOAL)
        assert told.success, told.message
        return found

    yield make
    for each in made:
        each.close()


@pytest.mark.full  # tests/system has a dead end, with processes
def test_it_goes_round_a_wall_and_the_recording_shows_how(going, tmp_path):
    record = tmp_path / "goal.mcap"
    found = going(ACROSS, record)
    found.until_over()
    assert found.status.state == TraversalStatus.DONE and found.off_m < 0.05
    assert found.said.drives > 1, "the first way led into the wall"
    assert not found.contacts
    assert any(len(call.request.leaving) for call in found.calls), "it looks for another way before it stops"
    found.close()
    (verdict,) = check_file("", record)
    assert verdict.passed, list(verdict.lines())
    assert not [note for note in verdict.notes if "not made again" in note]


def standing(going):
    """A robot at rest before a wall; the planner has had no way under way, and takes long for one from there."""
    found = going(ACROSS, answers=answers_late)
    turn_until(found, lambda: found.said.state == WayRound.PLANS)
    turn_until(found, lambda: answers_late(found.calls[-1].request) is None)
    assert found.robot._goal_way.plans
    assert found.robot._emulator.onboard.state == TraversalStatus.PAUSED
    return found


def answers_late(request):
    if not request.search.quick:
        return answer(request, VEHICLE)
    return PlanResponse(message="there is none") if request.leaving else None


@pytest.mark.parametrize("stop", [topics.ABORT, topics.PAUSE])
def test_a_stop_ends_a_plan_in_progress(going, operator, stop):
    found = standing(going)
    asked = len(found.calls)
    assert ask(operator, found, stop).success
    assert not found.robot._goal_way.plans
    late = found.calls[-1]
    late.reply(answer(late.request, VEHICLE))
    for _ in range(100):
        found.turn()
    stopped = TraversalStatus.ABORTED if stop is topics.ABORT else TraversalStatus.PAUSED
    assert found.status.state == stopped and found.said.state == WayRound.DRIVES
    assert len(found.calls) == asked


def test_a_stop_between_two_drives_ends_them(going, operator):
    found = standing(going)
    found.answers = at_once
    late = found.calls[-1]
    late.reply(answer(late.request, VEHICLE))
    service = found.robot._goal_way
    turn_until(found, lambda: service._ready is not None)
    told = ask(operator, found, topics.ABORT)
    assert told.success and "its job ends here" in told.message
    found.until_over()
    for _ in range(20):
        found.turn()
    assert found.status.state == TraversalStatus.ABORTED and found.said.drives == 1


def test_without_a_planner_it_says_so_and_waits_until_there_is_one(going):
    found = going(ACROSS)
    found.plan(there=False)
    turn_until(
        found, lambda: found.said.state == WayRound.FINDS_NO_WAY and found.status.state == TraversalStatus.PAUSED
    )
    assert any("no planner answers" in each.text for each in found.events)
    found.plan(there=True)
    turn_until(found, lambda: found.said.drives > 1)
    assert found.robot.active and not found.contacts


def test_another_goal_replaces_one_behind_a_wall(going, operator):
    found = standing(going)
    found.answers = at_once
    told = ask(operator, found, topics.GOTO, goal=PoseGoal(x_m=0.0, y_m=0.0))
    assert told.success, told.message
    found.reports.clear()
    found.until_over()
    assert found.status.state == TraversalStatus.DONE
    pose = found.robot._emulator.world.pose
    assert math.hypot(pose.east_m, pose.north_m) < 0.05
    assert any(each.text.endswith("another goal has come") for each in found.events)


@pytest.mark.full  # the proof takes a while
def test_it_gives_up_with_the_reason(going):
    found = going(ALL_ROUND)
    found.until_over()
    assert found.status.state == TraversalStatus.ABORTED
    assert "no way exists" in found.status.reason and "narrowest" in found.status.reason
