"""The status says what the robot believes, the topics under truth/ what is so; they differ when they should."""

import pytest

from tests.robot_sim.scripted import along_x
from touchline.onboard.interface import Checkpoint
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

VEHICLE = Vehicle()
PLAN = along_x(0, 4, 10, 12, sprayed=[0, 1, 0], ids=["to", "line", "on"])


def told(scenario, until_s=30.0, resume=None):
    """(last status while it ran, last truth beside it, every pair)."""
    emulator = Emulator(VEHICLE, scenario, OnboardConfig(follower="pure-pursuit"))
    emulator.load(PLAN, resume=resume)
    emulator.start()
    telemetry, runner = Telemetry(emulator), FastRunner(emulator)
    pairs, status = [], None
    while emulator.active and emulator.time_s < until_s:
        for topic, payload in telemetry.after(runner.step(telemetry.until_due(MOST_TICKS), telemetry.rows)):
            if topic is topics.STATUS:
                status = decode(topic.type, payload)
            elif topic is topics.TRUE_COVERAGE:
                pairs.append((status, decode(topic.type, payload)))
    return *pairs[-1], pairs


def test_both_agree_when_all_is_well():
    status, truth, pairs = told(Scenario(noise="none"))
    assert status.state == TraversalStatus.DONE
    assert status.painted_ids == truth.painted_ids == ("line",)
    assert status.coverage_pct == pytest.approx(100.0, abs=1e-9)
    assert truth.coverage_pct == pytest.approx(100.0, abs=0.5)
    assert all(before.header.stamp == beside.header.stamp for before, beside in pairs)
    assert all(abs(before.coverage_pct - beside.coverage_pct) < 2.5 for before, beside in pairs)
    assert {beside.flowing for _, beside in pairs} == {True, False}


def test_a_robot_whose_paint_does_not_come_believes_for_a_while_that_it_does():
    stuck = {"kind": "valve-stuck", "position": "closed", "start_s": 6.0}
    _, _, pairs = told(Scenario.model_validate({"noise": "none", "faults": [stuck]}), until_s=15.0)
    deceived = [(status, truth) for status, truth in pairs if status.spraying and not truth.flowing]
    status, truth = deceived[-1]
    assert status.coverage_pct > truth.coverage_pct + 1.0
    last, truth = pairs[-1]
    assert last.state == TraversalStatus.PAUSED, "the tank's level has told"
    assert last.coverage_pct == pytest.approx(truth.coverage_pct, abs=0.5), "what was dry counts no more"


def test_a_robot_that_is_somewhere_else_than_it_believes_paints_beside_the_line():
    wrong = {"kind": "gnss-wrong-fix", "start_s": 0.0, "east_m": 0.0, "north_m": 0.1}
    _, _, pairs = told(Scenario.model_validate({"noise": "none", "faults": [wrong]}))
    status, truth = pairs[-1]
    assert status.state == TraversalStatus.DONE
    assert (status.coverage_pct, truth.coverage_pct) == (pytest.approx(100.0), 0.0)
    spraying = [(status, truth) for status, truth in pairs if status.spraying and truth.flowing]
    assert max(abs(status.lateral_error_m) for status, _ in spraying) < 0.02
    assert min(abs(truth.lateral_error_m) for _, truth in spraying[1:]) > 0.07


def test_after_a_restart_the_robot_believes_in_paint_that_its_world_does_not_have():
    status, truth, pairs = told(Scenario(noise="none"), resume=Checkpoint(0, 7.0, 6.9))
    assert pairs[0][0].coverage_pct > 40.0 and pairs[0][1].coverage_pct == 0.0
    assert status.coverage_pct == pytest.approx(100.0)
    assert truth.coverage_pct < 60.0
