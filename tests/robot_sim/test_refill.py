"""Tank and battery are filled by order, whenever the robot stands."""

import json

import pytest

from tests.robot_sim.test_journal_kept import Robot
from touchline.schemas import faults as f
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.metrics import paint_metrics

FULL_L, FULL_WH = Vehicle().tool.tank_l, Vehicle().body.battery_wh


def test_a_full_tank_is_told_also_while_sim_time_stands_still():
    robot = Robot(None)
    robot.emulator.world.state.tank_l = 1.0
    assert robot.order(topics.REFILL_TANK).success
    told = {topic.name: payload for topic, payload in robot.commands.take()}
    assert decode(m.SprayerState, told[topics.SPRAYER.name]).tank_l == FULL_L
    assert decode(m.BatteryState, told[topics.BATTERY.name]).percentage == 1.0


def test_a_job_that_stopped_empty_goes_on_once_refilled():
    robot = Robot(None)
    robot.load()
    robot.emulator.start()
    while robot.emulator.onboard.status.arc_length_m < 2.5:
        robot.emulator.tick()
    robot.emulator.world.state.tank_l = 0.031
    assert "pause it first" in robot.order(topics.REFILL_TANK).message
    while robot.emulator.onboard.state == m.TraversalStatus.RUNNING:
        robot.emulator.tick()
    assert "wait until it stands" in robot.order(topics.REFILL_TANK).message
    for _ in range(200):
        robot.emulator.tick()
    assert "tank" in robot.order(topics.RESUME).message
    answer = robot.order(topics.REFILL_TANK)
    assert answer.success and f"{FULL_L:.2f} l now" in answer.message
    robot.emulator.tick()
    assert robot.order(topics.RESUME).success
    robot.drive()
    assert robot.emulator.onboard.state == m.TraversalStatus.DONE
    metrics = paint_metrics(robot.emulator.work.ledger)
    assert metrics.gap_m < 0.03


@pytest.mark.parametrize("service", [topics.REFILL_TANK, topics.REPLACE_BATTERY])
def test_both_are_full_afterwards(service):
    robot = Robot(None)
    robot.emulator.world.supply((1.0, 20.0, 3.0, 5.0))
    assert robot.order(service).success
    tank_l, battery_wh, *_ = robot.emulator.world.supplies
    assert (tank_l, battery_wh) == ((FULL_L, 20.0) if service is topics.REFILL_TANK else (1.0, FULL_WH))
    assert any(topic is topics.EVENTS for topic, _ in robot.commands.take())


@pytest.mark.parametrize(
    ("kind", "service", "full"),
    [("tank-empty", topics.REFILL_TANK, FULL_L), ("battery-low", topics.REPLACE_BATTERY, FULL_WH)],
)
def test_a_fault_of_what_is_filled_ends_with_it(kind, service, full):
    robot = Robot(None)
    robot.emulator.faults.inject(f.parse_fault(json.dumps({"kind": kind})), robot.emulator.tick_count)
    robot.emulator.faults.inject(f.parse_fault(json.dumps({"kind": "bumper"})), robot.emulator.tick_count)
    for _ in range(3):
        robot.emulator.tick()
    assert robot.order(service).success
    for _ in range(3):
        robot.emulator.tick()
    level = robot.emulator.world.supplies[0 if service is topics.REFILL_TANK else 1]
    assert level == pytest.approx(full, rel=1e-3)
    assert [each.fault.kind for each in robot.emulator.faults.timed] == ["bumper"]
