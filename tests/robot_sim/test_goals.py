"""Goals over the bus: the robot has the way planned from where it is, and sets off or drives on."""

import math
import re

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import AtOnce, ask, turn_until
from tests.with_full import with_full
from touchline.bus import Bus, HealthReporter
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import (
    Event,
    GotoRequest,
    GotoResponse,
    PlanOptions,
    PlanRequest,
    PoseGoal,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.request import answer
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.robot_process import RobotProcess
from touchline.services.robot_sim.warm_up import warm_up

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker

WAFFLE = SHIPPED["turtlebot3-waffle-pi"]
START = Pose2(x_m=1.0, y_m=0.5, heading_rad=0.3)
NEAR = PoseGoal(x_m=2.0, y_m=1.2, heading_rad=0.8)


class Planning:
    """The planner and a robot that is turned with it."""

    def __init__(self, bus, planner, speed, journal=None):
        self.robot = RobotProcess(
            bus,
            HealthReporter(bus),
            Setup(
                vehicle=WAFFLE.vehicle,
                onboard={"follower": WAFFLE.follower},
                scenario=Scenario(start=START, seed=2),
            ),
            AtOnce(bus),
            speed=speed,
            clock="held",
            journal=journal,
        )
        self.asked = []
        self._server = planner.serve(topics.PLAN_SERVICE) if planner is not None else None

    def turn(self):
        self.robot.turn()
        if self._server is not None and (call := self._server.poll()) is not None:
            self.asked.append(call.request)
            call.reply(answer(call.request, WAFFLE.vehicle))

    @property
    def active(self):
        return self.robot.active


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """Nobody waits for a compiler: the services compile before they answer."""
    warm_up(setup=Setup(vehicle=WAFFLE.vehicle, onboard={"follower": WAFFLE.follower}))
    answer(PlanRequest(goal=(NEAR,), options=PlanOptions(start=[0.0, 0.0, 0.0])), WAFFLE.vehicle)


@pytest.fixture
def planner(bus_config, bus):
    with Bus.open(topics.PLANNER, bus_config) as planner:
        yield planner


def last(inbox, kind):
    return [decode(kind, sample.payload) for sample in inbox.drain() if sample.topic.type is kind]


def test_a_robot_that_was_just_switched_on_goes_there(bus, operator, planner):
    both = Planning(bus, planner, speed=-1.0)
    events, reports = operator.inbox([topics.EVENTS]), operator.inbox([topics.REPORT])
    told = ask(operator, both, topics.GOTO, goal=NEAR)
    assert told.success, told.message
    assert told.message.startswith("to the goal: ")
    (plan,) = both.asked
    assert plan.options.start == pytest.approx([START.x_m, START.y_m, START.heading_rad], abs=0.1)
    turn_until(both, lambda: not both.active)
    found = []
    turn_until(both, lambda: found.extend(last(reports, TraversalReport)) or found)
    assert found[0].success
    assert found[0].total_time_s == pytest.approx(told.total_time, abs=1.0)
    codes = [event.code for event in last(events, Event)]
    assert codes == ["ready", "goal", "running", "done"]
    pose = both.robot._emulator.world.pose
    assert math.hypot(pose.east_m - NEAR.x_m, pose.north_m - NEAR.y_m) < 0.02
    told = ask(operator, both, topics.GOTO, goal=PoseGoal(x_m=2.5, y_m=1.4))
    assert told.success, "from where it stands"
    assert both.asked[-1].options.start == pytest.approx([NEAR.x_m, NEAR.y_m, NEAR.heading_rad], abs=0.03)


def test_another_goal_amid_the_drive_takes_over(bus, operator, planner, tmp_path):
    with Journal(tmp_path / "waffle.journal") as journal:
        both = Planning(bus, planner, speed=2.0, journal=journal)
        assert ask(operator, both, topics.GOTO, goal=NEAR).success
        emulator = both.robot._emulator
        turn_until(both, lambda: emulator.onboard.status.arc_length_m > 0.2)
        speeds = []
        told = ask(operator, both, topics.GOTO, goal=PoseGoal(x_m=3.0, y_m=1.0, heading_rad=0.0))
        assert told.success, told.message
        assert len(both.asked[-1].leaving) == 1
        for _ in range(50):
            both.turn()
            speeds.append(emulator.onboard.estimate.speed_mps)
        assert min(speeds) > 0.15, "it does not stop"
        ask(operator, both, topics.SET_SPEED, factor=-1.0)
        turn_until(both, lambda: not both.active)
        assert emulator.onboard.state == TraversalStatus.DONE
        assert math.hypot(emulator.world.pose.east_m - 3.0, emulator.world.pose.north_m - 1.0) < 0.02
        assert journal.checkpoint is None, "the journal knows that it is over"


def test_another_goal_amid_the_last_turn_waits_for_its_end(bus, operator, planner):
    both = Planning(bus, planner, speed=4.0)
    turned = PoseGoal(x_m=START.x_m, y_m=START.y_m, heading_rad=START.heading_rad + 3.0, method="turn-line-turn")
    assert ask(operator, both, topics.GOTO, goal=turned).success
    onboard = both.robot._emulator.onboard

    def turns_at_the_end() -> bool:
        status = onboard.status
        return status.remaining_s > 0.5 and status.arc_length_m == status.total_length_m > 0.0

    turn_until(both, turns_at_the_end)
    told = ask(operator, both, topics.GOTO, goal=NEAR)
    assert told.success, told.message
    ask(operator, both, topics.SET_SPEED, factor=-1.0)
    turn_until(both, lambda: not both.active)
    pose = both.robot._emulator.world.pose
    assert math.hypot(pose.east_m - NEAR.x_m, pose.north_m - NEAR.y_m) < 0.02


REFUSED = {
    "goal.x_m = nan": {"goal": PoseGoal(x_m=math.nan)},
    "duration_s = 0.5; give at least": {"goal": NEAR.model_copy(update={"duration_s": 0.5})},
    "options.start, .* leave it empty": {"goal": NEAR, "options": PlanOptions(start=[0.0, 0.0, 0.0])},
}


def test_what_cannot_be_is_refused_to_the_caller_and_in_the_log(bus, operator, planner):
    both = Planning(bus, planner, speed=-1.0)
    events = operator.inbox([topics.EVENTS])
    for says, request in REFUSED.items():
        told = ask(operator, both, topics.GOTO, **request)
        assert not told.success
        assert re.search(says, told.message)
        (refused,) = [event for event in last(events, Event) if event.code == "goal-refused"]
        assert refused.severity == Event.ERROR
        assert both.robot._emulator.onboard.state == TraversalStatus.IDLE


def test_paused_or_stopped_it_is_refused_with_the_remedy(bus, operator, planner):
    both = Planning(bus, planner, speed=-1.0)
    assert ask(operator, both, topics.GOTO, goal=PoseGoal(x_m=30.0, y_m=3.0)).success
    assert ask(operator, both, topics.PAUSE).success
    assert "paused; resume or abort it first" in ask(operator, both, topics.GOTO, goal=NEAR).message
    assert ask(operator, both, topics.ESTOP).success
    assert "emergency-stopped; reset it first" in ask(operator, both, topics.GOTO, goal=NEAR).message


@pytest.mark.parametrize(
    ("stop", "driving"),
    with_full(
        *((stop, True) for stop in (topics.PAUSE, topics.ABORT, topics.ESTOP)),
        (topics.ESTOP, False),
        full=((topics.PAUSE, False), (topics.ABORT, False)),
    ),
)
def test_a_stop_cancels_a_goal_that_is_being_planned(bus, operator, stop, driving):
    with Bus.open(topics.PLANNER, bus.config) as planner:
        both = Planning(bus, planner, speed=2.0)
        if driving:
            assert ask(operator, both, topics.GOTO, goal=PoseGoal(x_m=20.0, y_m=3.0)).success
            turn_until(both, lambda: both.robot._emulator.onboard.status.arc_length_m > 0.1)
        asked = len(both.asked)
        caught_up(operator, bus)  # a question is not asked again: the robot's service has to be known
        question = operator.ask(topics.GOTO, encode(GotoRequest(request_id="goal", goal=NEAR)), 60.0)
        turn_until(both.robot, lambda: both.robot._goals._asked is not None and both.robot._goals._asked.question)
        ask(operator, both.robot, stop)
        told = []
        turn_until(both, lambda: told.extend(filter(None, [question.poll()])) or told)
        assert "told to stop meanwhile" in decode(GotoResponse, told[0].payload).message
        turn_until(both, lambda: len(both.asked) > asked)
        for _ in range(30):
            both.turn()
        assert both.robot._emulator.onboard.state != TraversalStatus.RUNNING


def test_without_a_planner_it_says_so(bus, operator, monkeypatch):
    monkeypatch.setattr(
        "touchline.services.robot_sim.goals.PATIENCE_S", 5.0
    )  # in which the robot has to find out where it stands, too
    both = Planning(bus, None, speed=-1.0)
    assert "no planner answers" in ask(operator, both, topics.GOTO, goal=NEAR).message


def test_while_sim_time_is_held_it_does_not_find_out_where_it_stands(bus, operator, planner, monkeypatch):
    monkeypatch.setattr("touchline.services.robot_sim.goals.PATIENCE_S", 0.2)
    both = Planning(bus, planner, speed=0.0)
    assert "does sim time pass" in ask(operator, both, topics.GOTO, goal=NEAR).message
