"""A whole robot in-process: what a tick does, and what is said of a session."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_sim.scripted import ScriptedOnboard, along_x, line_script, trajectory
from tests.two_wheels import STANDSTILL
from touchline.onboard.interface import Command
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import (
    Actuation,
    ActuationProfile,
    Arc,
    CurveMessage,
    CurveType,
    Line,
    Path,
    PathActuationParameter,
    Point,
    Segment,
    TraversalStatus,
)
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.settling import RESTING_MPS, SETTLE_TICKS
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

pytestmark = pytest.mark.xdist_group("scripted session")  # which is driven once
PLAN = along_x(0, 2, 9, 12, sprayed=[0, 1, 0])
TEMPLATE = Template(name="one", segments=[{"id": "s1", "line": {"start": (2.0, -0.41124), "end": (9.0, -0.41124)}}])


def scripted(scenario=None, script=line_script):
    return Emulator(Vehicle(), scenario or Scenario(noise="none"), onboard=ScriptedOnboard(script))


def run(emulator, template=TEMPLATE):
    """Every payload of a whole session."""
    telemetry = Telemetry(emulator)
    emulator.load(PLAN, template)
    said = list(telemetry.loaded(PLAN, template))
    emulator.start()
    while emulator.active:
        emulator.tick()
        said += telemetry.after_tick()
    return said


def of(said, topic):
    return [decode(topic.type, payload) for name, payload in said if name is topic]


@pytest.fixture(scope="module")
def session():
    """The emulator after a whole session, and every payload of it."""
    emulator = scripted()
    return emulator, run(emulator)


def test_a_session_from_load_to_report(session):
    emulator, said = session
    reports = of(said, topics.REPORT)
    assert len(reports) == 1
    (report,) = reports
    assert report.success
    assert report.template_length_m == pytest.approx(7.0)
    assert report.coverage_pct == pytest.approx(100.0 * (7.0 - report.gap_m) / 7.0)
    marks = of(said, topics.PAINT)
    painted = sum(float(np.hypot(np.diff(mark.x_m), np.diff(mark.y_m)).sum()) for mark in marks)
    assert painted == pytest.approx(report.painted_length_m, abs=1e-9)
    assert [mark.first_index for mark in marks] == [
        sum(len(mark.x_m) - 1 for mark in marks[:index]) for index in range(len(marks))
    ]
    last = of(said, topics.STATUS)[-1]
    assert last.state == TraversalStatus.DONE
    truth = of(said, topics.TRUE_COVERAGE)[-1]
    assert truth.painted_ids == ("s1",)
    assert truth.painted_fraction[0] == pytest.approx(report.coverage_pct / 100)
    assert truth.coverage_pct == pytest.approx(report.coverage_pct)
    assert not truth.flowing
    assert abs(emulator.world.state.speed_mps) < 1e-6
    assert of(said, topics.TRUTH)[-1].pose.pose.position.x == pytest.approx(emulator.world.pose.east_m, abs=1e-3)


def test_rates_are_those_of_the_topic_table(session):
    emulator, said = session
    for topic in topics.TOPICS:
        count = sum(1 for name, _ in said if name is topic)
        if (
            topic.rate_hz
            and topic.recorded
            and topic.general
            and topic not in (topics.PAINT, topics.STATUS, topics.TRUE_COVERAGE, topics.SPRAYER)
        ):
            assert count == pytest.approx(emulator.time_s * topic.rate_hz, abs=2), topic.name


def test_stamps_are_sim_time_and_never_go_back(session):
    _, said = session
    for topic in (topics.IMU, topics.TRUTH, topics.GNSS_FIX, topics.STATUS, topics.TRUE_COVERAGE):
        stamps = [message.header.stamp for message in of(said, topic)]
        times = [stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps]
        assert times == sorted(times)
    fixes = of(said, topics.GNSS_FIX)
    assert fixes[0].header.stamp.nanosec == 100_000_000


def test_sprayer_state_is_told_when_it_changes(session):
    _, said = session
    states = of(said, topics.SPRAYER)
    changes = [(state.valve_commanded, state.valve_open) for state in states]
    order = [pair for index, pair in enumerate(changes) if index == 0 or pair != changes[index - 1]]
    assert order == [(False, False), (True, False), (True, True), (False, True), (False, False)]


def test_touchlines_own_computer_paints_and_knows_how_far_it_may_err():
    emulator = Emulator(Vehicle(), Scenario(seed=3))
    telemetry, runner, said = Telemetry(emulator), FastRunner(emulator), []
    emulator.load(along_x(0, 2, 4, 5, sprayed=[0, 1, 0], speed_mps=0.5))
    emulator.start()
    while emulator.active:
        said += telemetry.after(runner.step(telemetry.until_due(MOST_TICKS), telemetry.rows))
    (report,) = of(said, topics.REPORT)
    assert report.success
    assert report.coverage_pct > 98.0
    assert report.lateral_error_max_m < 0.03
    assert 0.0 < report.position_rmse_m < 0.05
    pairs = list(zip(of(said, topics.ODOMETRY), of(said, topics.TRUTH), strict=True))[50:]
    for at, rate in ((0, lambda odometry: odometry.twist.twist.linear.x), (35, lambda o: o.twist.twist.angular.z)):
        variance = np.array([told.twist.covariance[at] for told, _ in pairs])
        errors = np.array([rate(told) - rate(true) for told, true in pairs])
        assert np.all(variance > 0.0)
        assert 0.2 < np.mean(errors**2 / variance) < 3.0, "as far off as it says"
    assert pairs[-1][0].twist.covariance[5] == pairs[-1][0].twist.covariance[30] != 0.0


def test_load_places_the_robot_at_the_start_of_the_plan_or_of_the_scenario():
    emulator = scripted()
    emulator.load(trajectory([Curve.from_line((5, 5), (5, 9))], [1], directions=[-1]))
    assert emulator.world.pose[:2] == (5.0, 5.0)
    assert np.cos(emulator.world.pose.heading_rad + np.pi / 2) == pytest.approx(1.0)
    emulator = scripted(Scenario(start=Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)))
    emulator.load(PLAN)
    assert emulator.world.pose == (1.0, 2.0, 0.5)


def bad(*segments):
    return PLAN.model_copy(update={"path": Path(segments=segments)})


ON_THE_SPOT = Segment(id="spin", curve=CurveMessage(type=CurveType(value=CurveType.ARC), arc=(Arc(sweep_angle=1.0),)))
NOT_A_NUMBER = Segment(
    id="nan",
    curve=CurveMessage(type=CurveType(value=CurveType.ARC), arc=(Arc(start=Point(x=float("nan")), sweep_angle=1.0),)),
)


@pytest.mark.parametrize("plan", [bad(), bad(ON_THE_SPOT), bad(NOT_A_NUMBER), bad(Segment(id="none"))])
def test_a_trajectory_that_cannot_be_driven_is_refused_and_changes_nothing(plan):
    emulator = Emulator(Vehicle(), Scenario())
    with pytest.raises(CommandRefused):
        emulator.load(plan)
    with pytest.raises(CommandRefused):
        emulator.start()
    assert emulator.work.ledger.targets == []
    assert not emulator.active


def test_nothing_moves_before_the_start_and_watching_ends_after_the_end():
    emulator = scripted()
    assert not emulator.active
    emulator.load(PLAN)
    assert not emulator.active
    assert emulator.time_s == 0.0
    emulator.start()
    settled = []
    while emulator.active:
        emulator.tick()
        if emulator.settled:
            settled.append(emulator.tick_count)
    assert settled == [emulator.tick_count]
    assert emulator.tick_count == 1251 - 1 + SETTLE_TICKS


def test_a_robot_that_is_aborted_at_speed_is_watched_until_it_rests_and_then_takes_a_plan():
    """Sim time is held once nothing is watched: a robot that still moved then would refuse every plan."""
    emulator = Emulator(Vehicle(), Scenario(noise="none"))
    emulator.load(PLAN)
    emulator.start()
    while emulator.world.state.speed_mps < 0.95:
        assert emulator.active
        emulator.tick()
    emulator.abort("not today")
    rested = 0
    while emulator.active:
        emulator.tick()
        rested = rested + 1 if abs(emulator.world.state.speed_mps) <= RESTING_MPS else 0
    assert rested >= SETTLE_TICKS // 2
    emulator.load(PLAN)


def test_a_command_acts_from_the_next_tick_on():
    emulator = scripted(script=lambda tick: Command((10.0, 10.0), False, False))
    emulator.load(PLAN)
    emulator.start()
    emulator.tick()
    assert emulator.world.drive.rate_radps[0] == 0.0
    assert emulator.command != STANDSTILL
    emulator.tick()
    assert emulator.world.drive.rate_radps[0] > 0.0


def test_report_of_an_aborted_traversal_is_no_success():
    emulator = scripted()
    telemetry = Telemetry(emulator)
    emulator.load(PLAN, TEMPLATE)
    emulator.start()
    for _ in range(400):
        emulator.tick()
    emulator.abort()
    said = []
    while emulator.active:
        emulator.tick()
        said += telemetry.after_tick()
    (report,) = of(said, topics.REPORT)
    assert not report.success
    assert 0.0 < report.coverage_pct < 50.0


ANY_NUMBER = st.floats(allow_nan=True, allow_infinity=True)
ANY_POINT = st.builds(Point, x=ANY_NUMBER, y=ANY_NUMBER)
ANY_CURVE = st.one_of(
    st.builds(lambda a, b: CurveMessage(type=CurveType(value=1), line=(Line(start=a, end=b),)), ANY_POINT, ANY_POINT),
    st.builds(
        lambda a, b, sweep: CurveMessage(type=CurveType(value=2), arc=(Arc(start=a, center=b, sweep_angle=sweep),)),
        ANY_POINT,
        ANY_POINT,
        ANY_NUMBER,
    ),
    st.builds(CurveMessage, type=st.builds(CurveType, value=st.integers(0, 2))),
)


@given(st.lists(ANY_CURVE, max_size=4), ANY_NUMBER)
def test_no_trajectory_does_worse_than_being_refused(curves, arc_length):
    emulator = Emulator(Vehicle(), Scenario())
    spray = PathActuationParameter(arc_length=arc_length, actuation=Actuation(value=Actuation.SPRAY))
    plan = PLAN.model_copy(
        update={
            "path": Path(segments=tuple(Segment(id="s", curve=curve) for curve in curves)),
            "actuation_profile": ActuationProfile(parameters=(spray,)),
        }
    )
    with suppress(CommandRefused):
        emulator.load(plan)
        emulator.start()
        emulator.tick()


def test_a_free_clock_may_run_before_anything_is_loaded():
    emulator = Emulator(Vehicle(), Scenario(start=Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)))
    telemetry = Telemetry(emulator)
    for _ in range(300):
        emulator.tick()
        telemetry.after_tick()
    assert emulator.world.pose == (1.0, 2.0, 0.5)
    assert not emulator.settled
