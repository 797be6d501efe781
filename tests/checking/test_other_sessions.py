"""Sessions that go on from a process that died, of guided robots, and of the estimator alone, tick by tick."""

import re

import numpy as np
import pytest

from tests.checking.day_of_jobs import Day, write
from tests.checking.short_sessions import BRIEF, ORDERS, bend
from touchline.checking import estimator_alone
from touchline.checking.check_session import check_recording
from touchline.checking.divergence import stamp_ns
from touchline.checking.open_loop_computer import OpenLoopComputer
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_sensors import RecordedAuxiliary, RecordedSensors
from touchline.checking.recorded_session import NotRebuilt, RecordedSession, TimedOrder
from touchline.checking.robot_messages import RobotMessages
from touchline.checking.sensor_frames import SENSED, sensor_frames
from touchline.recordings.recorded import Recorded
from touchline.schemas import topics
from touchline.schemas.messages import Guidance
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.vehicles.shipped import SHIPPED, on_its_ground, with_its_own
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.telemetry import Telemetry

pytestmark = pytest.mark.xdist_group("checking")
ROBOT = "tt2"
KILLED_TICK = 540


def begun(vehicle, scenario, config=None):
    emulator = Emulator(vehicle, scenario, config)
    telemetry = Telemetry(emulator)
    return emulator, telemetry, [telemetry.setup(), *telemetry.standing(), *telemetry.awake()]


def driven(emulator, telemetry, ticks):
    told = []
    for _ in range(ticks):
        emulator.tick()
        told += telemetry.after_tick()
    return told


@pytest.fixture(scope="module")
def resumed(tmp_path_factory):
    """The robot's process is killed while it paints the bend, and the next one goes on from its journal."""
    day = Day()
    day.load()
    day.order("start")
    day.drive(KILLED_TICK)
    assert day.emulator.totals.points > 10
    day.be_killed()
    day.order("start")
    day.drive(150)
    day.order("abort")
    day.drive()
    return write(tmp_path_factory.mktemp("resumed") / "resumed.mcap", day.told)


def test_what_goes_on_from_a_process_that_died_is_done_again(resumed):
    first, second = check_recording(resumed, exact=True)
    assert (first.process, second.process) == (1, 2)
    for one in (first, second):
        assert one.passed, (one.problem, str(one.first))
        assert one.diff.topics[topics.IMU.name].pairs > 200
    assert second.diff.topics[topics.REPORT.name].pairs == 1


def test_a_later_job_is_not_done_again_without_the_robots_state_at_its_begin(tmp_path):
    """As in recordings that are older than these."""
    day = Day()
    day.brief_job()
    day.brief_job()
    told = [each for each in day.later(0) if each[0] is not topics.INITIAL_STATE]
    (verdict,) = check_recording(write(tmp_path / "second.mcap", told))
    assert re.search(r"running for [\d.]+ s of sim time before the recording begins", verdict.problem)


def test_a_session_with_a_truth_of_its_own_is_done_again(tmp_path):
    truth = {"gyro_scale_relative": 0.01, "antenna_x_m": 0.03, "stamp_jitter_s": 0.01, "wander_rad": 0.02}
    place = {"outline": [(-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)]}
    world = {"truth": truth, "ground": {"roughness": "C"}, "gnss": {"burst_share": 0.1}, "multipath": [place]}
    (verdict,) = check_recording(bend(tmp_path / "truth.mcap", BRIEF, **world))
    assert verdict.passed, (verdict.problem, str(verdict.first))


@pytest.mark.parametrize(
    "hours, refused", [(1, "setup"), (100, "100 h, with messages of 0 h"), (1e6, "reaches 1,000,000 h")]
)
def test_a_length_that_is_only_claimed_is_refused(hours, refused):
    """All its ticks would be run, and have room kept for them."""
    claimed = [Recorded(f"/{ROBOT}/clock", 0, round(each * 3.6e12), 0, b"", None) for each in (0.001, hours)]
    with pytest.raises(NotRebuilt, match=refused):
        RecordedSession.of(claimed)


def test_other_remains_are_a_difference(resumed, monkeypatch):
    real = Emulator.prepare

    def prepare(self, trajectory, template, resume=None, earlier=None, *others):
        if earlier is not None:
            earlier = earlier._replace(paint=earlier.paint[:-5])
        return real(self, trajectory, template, resume, earlier, *others)

    monkeypatch.setattr(Emulator, "prepare", prepare)
    first, second = check_recording(resumed, exact=True)
    assert first.passed
    assert second.part == "paint"


def test_a_part_alone_says_why_it_is_not_run_on_what_goes_on(resumed):
    first, second = check_recording(resumed, exact=True, only="estimator")
    assert first.passed, (first.problem, str(first.first))
    assert "after a restart of the robot's process" in second.problem


@pytest.fixture(scope="module")
def guided(tmp_path_factory):
    """A robot that is guided to two places, one after the other."""
    name = "turtlebot3-waffle-pi"
    world = Scenario(seed=2, start=Pose2(x_m=0.5, y_m=0.5, heading_rad=0.3))
    config = with_its_own(name, OnboardConfig())
    emulator, telemetry, told = begun(SHIPPED[name].vehicle, on_its_ground(name, world), config)
    emulator.begin_guided()
    told += telemetry.begin([])
    room = np.array([(1.0, 0.0, 9.0), (-1.0, 0.0, 9.0), (0.0, 1.0, 9.0), (0.0, -1.0, 9.0)]).ravel()
    for step in range(20):
        x_m, number = (1.5, 1) if step < 10 else (0.0, 2)
        stamp_s = emulator.onboard.whereabouts.stamp_s
        emulator.take_guidance(Guidance(number=number, echo_s=stamp_s, target_x_m=x_m, half_planes=room))
        emulator.take_guidance(Guidance(number=99, echo_s=float("nan")))
        told += driven(emulator, telemetry, 20)
    emulator.abort()
    told += telemetry.news() + driven(emulator, telemetry, 110)
    return write(tmp_path_factory.mktemp("guided") / "guided.mcap", told)


def test_a_guided_robot_is_done_again(guided):
    (one,) = check_recording(guided, exact=True)
    assert one.passed, (one.problem, str(one.first))
    assert one.diff.topics[topics.WHEREABOUTS.name].pairs > 30
    assert one.diff.topics[topics.TRUTH.name].pairs > 200


@pytest.mark.parametrize("part", ["estimator", "follower"])
def test_a_part_alone_is_run_on_the_poses_of_a_camera(guided, part):
    (one,) = check_recording(guided, exact=True, only=part)
    assert one.passed, (one.problem, str(one.first))
    assert "within tolerances" in one.notes[0]
    assert sum(each.pairs for each in one.diff.topics.values()) > 200


def test_other_guidance_is_a_difference(guided, monkeypatch):
    real = Emulator.take_guidance
    monkeypatch.setattr(
        Emulator,
        "take_guidance",
        lambda self, told: real(self, told.model_copy(update={"target_x_m": told.target_x_m + 0.01})),
    )
    (one,) = check_recording(guided, exact=True)
    assert not one.passed


def test_the_estimator_in_one_kernel_does_what_it_does_tick_by_tick(tmp_path):
    outage = {"kind": "gnss-outage", "start_s": 0.7, "duration_s": 1.0}
    orders = (TimedOrder(0, "start", {}), ORDERS[1]._replace(tick=250), BRIEF[1]._replace(tick=400))
    receiver = {"reacquire_s": 0.5, "float_after_s": 0.5, "converge_min_s": 1.0, "converge_max_s": 1.0}
    messages = RobotMessages(bend(tmp_path / "bend.mcap", orders, faults=[outage], gnss=receiver), ROBOT)
    came = messages.tables(SENSED).of(SENSED)
    session = RecordedSession.of(messages)
    frames = sensor_frames(session.setup, came, session.last_tick)
    fast = [
        (topic, each)
        for said in estimator_alone.estimates_again(session, frames)
        for topic, payloads in said
        for each in payloads.each()
    ]
    computer = OpenLoopComputer(session.setup, session.commands)
    rebuild = Rebuild(session, computer, (RecordedSensors(session.setup, frames), RecordedAuxiliary(session.setup, {})))
    plain = [each for payloads in rebuild.messages() for each in payloads]
    for topic, least in ((topics.ODOMETRY, 200), (topics.ESTIMATOR, 40)):
        one, other = ([payload for of, payload in said if of == topic and stamp_ns(payload)] for said in (fast, plain))
        assert one == other
        assert len(one) >= least
