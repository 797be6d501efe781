"""Faults of messages on the topics: whatever becomes of them on their way, what they say stays what it was."""

import json
from functools import cache
from itertools import pairwise

import pytest

from tests.robot_sim.scripted import ScriptedOnboard, along_x, line_script
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import JointState
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.telemetry import Telemetry

PLAN = along_x(0, 12, sprayed=[0])
TOPICS = {
    "gnss": (topics.GNSS_FIX, topics.GNSS_STATUS),
    "imu": (topics.IMU,),
    "magnetometer": (topics.MAGNETIC_FIELD,),
    "encoder": (topics.JOINT_STATES,),
}
KINDS = {
    "messages-late": {"delay_s": 0.07},
    "messages-lost": {"share": 0.5},
    "messages-duplicated": {"after_s": 0.03, "share": 0.5},
    "messages-reordered": {"spread_s": 0.25},
}


@cache
def said(*faults):
    """(tick, payload) by topic of two and a half seconds, the robot driving and speeding up."""
    emulator = Emulator(Vehicle(), Scenario(faults=faults), onboard=ScriptedOnboard(line_script))
    telemetry, heard = Telemetry(emulator), {topic.name: [] for topic in topics.TOPICS}
    emulator.load(PLAN)
    emulator.start()
    for _ in range(250):
        emulator.tick()
        for topic, payload in telemetry.after_tick():
            heard[topic.name].append((emulator.tick_count, payload))
    return heard


@pytest.mark.parametrize("sensor", TOPICS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_message_that_goes_astray_says_what_it_would_have_said(kind, sensor):
    fault = {"kind": kind, "sensor": sensor, "start_s": 0.55, "duration_s": 1.0, **KINDS[kind]}
    astray, plain = said(parse_fault(json.dumps(fault))), said()
    told = {topics.EVENTS.name, *(topic.name for topic in TOPICS[sensor])}
    for name in plain.keys() - told:
        assert astray[name] == plain[name], name
    for topic in TOPICS[sensor]:
        if kind != "messages-duplicated" or sensor == "gnss":  # of the others a newer one comes in every tick, and wins
            assert astray[topic.name] != plain[topic.name]
        assert payloads(astray[topic.name]) <= payloads(plain[topic.name]), topic.name


def payloads(heard):
    return {payload for _, payload in heard}


def test_wheel_rates_are_by_the_readings_of_the_tick_before():
    states = [decode(JointState, payload) for _, payload in said()[topics.JOINT_STATES.name]]
    for before, after in pairwise(states):
        turned = [b - a for a, b in zip(before.position, after.position, strict=True)]
        assert after.velocity == pytest.approx([100.0 * angle for angle in turned], abs=1e-9)
    assert states[-1].velocity == pytest.approx([10.0, 10.0], abs=0.3)
