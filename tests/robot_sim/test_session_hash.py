"""One session, one hash: at every pace, held or not, on the bus or without it."""

import pytest

from tests.robot_sim.bus_rig import PLAN, TEMPLATE, alone, ask, drain, hash_in, process, setup, turn_until
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.digest import SessionDigest
from touchline.schemas.messages import TraversalReport
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry


@pytest.fixture(scope="module")
def said():
    return alone(seed=5)


def test_the_report_carries_the_hash_of_all_that_was_said(said):
    report = decode(TraversalReport, next(payload for topic, payload in said if topic is topics.REPORT))
    blank = encode(report.model_copy(update={"session_hash": ""}))
    digest = SessionDigest()
    digest.add((topic, blank if topic is topics.REPORT else payload) for topic, payload in said)
    assert digest.hexdigest() == report.session_hash


def test_another_seed_or_follower_has_another_hash(said):
    hashes = {hash_in(said), hash_in(alone(seed=6)), hash_in(alone(seed=5, follower="mpc"))}
    assert len(hashes) == 3
    assert "" not in hashes


def test_holding_the_clock_changes_nothing(said, bus, operator):
    robot = process(bus, speed=5.0, seed=5)
    inbox = operator.inbox([topics.REPORT])
    ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json=TEMPLATE.model_dump_json())
    ask(operator, robot, topics.START)
    heard: list = []
    turn_until(robot, lambda: robot._emulator.onboard.spraying)
    ask(operator, robot, topics.SET_SPEED, factor=0.0)
    held_s = robot._emulator.time_s
    for _ in range(10):
        robot.turn()
    assert robot.active and robot._emulator.time_s == held_s
    ask(operator, robot, topics.SET_SPEED, factor=-1.0)
    turn_until(robot, lambda: any(topic is topics.REPORT for topic, _ in drain(inbox, heard)))
    assert hash_in(heard) == hash_in(said)


def test_a_second_traversal_begins_a_new_session(said):
    robot = setup(seed=5)
    emulator = Emulator(robot.vehicle, robot.scenario, robot.onboard)
    telemetry, runner = Telemetry(emulator), FastRunner(emulator)
    hashes = []
    for _ in range(2):
        emulator.load(PLAN, TEMPLATE)
        telemetry.loaded(PLAN, TEMPLATE)
        assert telemetry.final is None
        emulator.start()
        telemetry.news()
        while emulator.active:
            telemetry.after(runner.step(telemetry.until_due(MOST_TICKS), telemetry.rows))
        assert telemetry.final is not None
        hashes.append(telemetry.final.traversal.session_hash)
    assert hashes[0] == hash_in(said)
    assert hashes[1] != hashes[0], "sim time went on, and it is in every header"
