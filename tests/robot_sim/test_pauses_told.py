"""Pauses, warnings and what a standing robot knows, as messages: in one process and over the bus."""

import math

import pytest

from tests.robot_sim.bus_rig import AWAKE, alone, drain, process, turn_until
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.faults import parse_fault
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.telemetry import Telemetry


def decoded(said, *wanted):
    return [decode(topic.type, payload) for topic, payload in said if topic in wanted]


def test_a_pause_that_ends_by_itself_says_so_and_the_robot_warns_before_it_moves_off():
    outage = {"kind": "gnss-outage", "start_s": 1.0, "duration_s": 4.0}
    said = alone(noise="none", faults=[outage])
    (began,) = [w for w in decoded(said, topics.ABOUT_TO_MOVE) if w.active and w.reason == "goes on by itself"]
    warned_s, moves_s = began.header.stamp.seconds, began.earliest.sec + began.earliest.nanosec / 1e9
    assert moves_s == pytest.approx(warned_s + 2.0)
    speeds = [(o.header.stamp.seconds, o.twist.twist.linear.x) for o in decoded(said, topics.TRUTH)]
    assert all(abs(speed) < 1e-3 for at_s, speed in speeds if warned_s - 1.0 <= at_s <= moves_s)
    assert any(speed < -0.05 for at_s, speed in speeds if at_s > moves_s), "it goes back to where paint is owed"
    statuses = [s.header.stamp for s in decoded(said, topics.STATUS) if s.state == m.TraversalStatus.PAUSED]
    pauses = decoded(said, topics.PAUSE_STATUS)
    assert [p.header.stamp for p in pauses[:-1]] == statuses, "one with every status, before it"
    assert {(p.cause, p.source, p.ends_by_itself) for p in pauses[:-1]} == {(5, "localization", True)}
    assert (pauses[-1].cause, pauses[-1].ends_by_itself) == (m.PauseStatus.NONE, False)
    assert all(p.earliest.sec + p.earliest.nanosec / 1e9 <= moves_s for p in pauses), "at the earliest"
    ends = decoded(said, topics.ABOUT_TO_MOVE)[-1]
    assert not ends.active, "the job is done"


def test_a_session_without_a_pause_says_nothing_of_pauses():
    said = alone()
    assert decoded(said, topics.PAUSE_STATUS) == []
    assert [w.active for w in decoded(said, topics.ABOUT_TO_MOVE)] == [True, False]


def test_looking_round_changes_nothing_of_the_robot():
    start = Pose2(x_m=3.0, y_m=-2.0, heading_rad=1.2)
    emulator = Emulator(Vehicle(), Scenario(start=start, seed=4))
    before = emulator.world.state.array.tobytes()
    said = Telemetry(emulator).awake()
    assert emulator.world.state.array.tobytes() == before
    assert (emulator.tick_count, emulator.onboard.aligned) == (0, False)
    (odometry,) = decoded(said, topics.ODOMETRY)
    place = odometry.pose.pose
    assert (place.position.x, place.position.y) == (pytest.approx(3.0, abs=0.05), pytest.approx(-2.0, abs=0.05))
    assert 2.0 * math.atan2(place.orientation.z, place.orientation.w) == pytest.approx(1.2, abs=0.3)


def test_a_robot_without_a_fix_does_not_know_its_place():
    faults = [parse_fault('{"kind": "gnss-outage", "start_s": 0.0, "duration_s": 60.0}')]
    said = Telemetry(Emulator(Vehicle(), Scenario(faults=faults))).awake()
    assert decoded(said, topics.ODOMETRY) == []
    assert decoded(said, topics.GNSS_STATUS)[0].fix == m.GnssStatus.NONE
    assert decoded(said, topics.SPRAYER)[0].tank_l == 20.0


def test_levels_and_place_are_known_before_anything_is_started(bus, operator):
    robot = process(bus)
    inbox = operator.inbox([*AWAKE], keep="latest")
    said = []
    turn_until(robot, lambda: len({topic.name for topic, _ in drain(inbox, said)}) == len(AWAKE))
    assert decoded(said, topics.SPRAYER)[0].tank_l == 20.0
    assert decoded(said, topics.BATTERY)[0].percentage == 1.0
    assert decoded(said, topics.ODOMETRY)[0].header.stamp.seconds == 0.0
