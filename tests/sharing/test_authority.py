"""The limit of a robot's authority: it comes to rest there, valve closed, and goes on when it may."""

import math
from functools import cache

import numpy as np
import pytest

from tests.planner.drawn import drawn
from touchline.onboard import Onboard
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.paint.metrics import paint_metrics

VEHICLE = Vehicle()
TEMPLATE = drawn((0.0, 0.0, 6.0, 0.0), (6.0, 5.0, 0.0, 5.0))
BETWEEN = 14.0
"""In the turn from one line to the other."""


@cache
def planned():
    return plan(TEMPLATE, VEHICLE)


class Robot:
    """An emulated robot that has loaded the plan, with what it is allowed."""

    def __init__(self, follower="mpc", until_m=math.inf):
        config = OnboardConfig(follower=follower)
        self.onboard = Onboard(VEHICLE, config)
        self.emulator = Emulator(VEHICLE, Scenario(seed=3), config, self.onboard)
        self.emulator.load(planned().trajectory, TEMPLATE)
        self.onboard.authorize(until_m)
        self.emulator.start()
        self.runner = FastRunner(self.emulator)

    def run(self, seconds, fast=True):
        for _ in range(round(10 * seconds)):
            if self.onboard.state == TraversalStatus.DONE:
                return
            if fast:
                self.runner.run(10)
            else:
                for _ in range(10):
                    self.emulator.tick()

    @property
    def place(self):
        return self.onboard.status.arc_length_m

    @property
    def rests(self):
        return abs(self.emulator.world.state.speed_mps) < 0.005


@pytest.mark.parametrize(
    ("until_m", "follower"),
    [
        *((until_m, "mpc") for until_m in (0.0, BETWEEN)),
        (BETWEEN, "pure-pursuit"),
        pytest.param(2.0, "mpc", marks=pytest.mark.full),
        *(pytest.param(until_m, "pure-pursuit", marks=pytest.mark.full) for until_m in (0.0, 2.0)),
        *(pytest.param(until_m, "nonlinear", marks=pytest.mark.full) for until_m in (0.0, 2.0, BETWEEN)),
    ],
)
def test_it_rests_where_it_may_drive_no_further_and_goes_on(until_m, follower):
    robot = Robot(follower, until_m)
    robot.run(10 + 2 * until_m)
    assert robot.rests and robot.place == pytest.approx(until_m, abs=0.03) and robot.onboard.held
    assert "others are in the way" in robot.onboard.status.reason and not robot.onboard.spraying
    robot.onboard.authorize(math.inf)
    robot.run(60)
    assert robot.onboard.state == TraversalStatus.DONE and not robot.onboard.held
    metrics = paint_metrics(robot.emulator.work.ledger)
    assert metrics.verdict.accepted and metrics.double_paint_m2 == 0.0


def test_nominal_ticks_keep_to_it_with_the_same_bits():
    fast, slow = Robot("pure-pursuit", BETWEEN), Robot("pure-pursuit", BETWEEN)
    for robot in (fast, slow):
        robot.run(40, fast=robot is fast)
        robot.onboard.authorize(math.inf)
        robot.run(8, fast=robot is fast)
    assert fast.emulator.world.pose == slow.emulator.world.pose
    np.testing.assert_array_equal(fast.emulator.work.ledger.rows(0), slow.emulator.work.ledger.rows(0))


def test_one_that_is_moved_on_in_time_does_not_know():
    free, led = Robot("pure-pursuit"), Robot("pure-pursuit", 3.0)
    for _ in range(200):
        led.onboard.authorize(led.place + 3.0)
        for robot in (free, led):
            robot.run(0.1)
    assert led.emulator.world.pose == free.emulator.world.pose


def test_amid_a_line_the_valve_is_closed_and_the_rest_is_painted_once():
    on_a = planned().painted[0].start_m + 3.0
    robot = Robot("mpc", on_a)
    robot.run(40)
    assert robot.rests and robot.place == pytest.approx(on_a, abs=0.03) and not robot.onboard.spraying
    before = robot.emulator.work.ledger.points
    robot.run(5)
    assert robot.emulator.work.ledger.points == before
    robot.onboard.authorize(math.inf)
    robot.run(60)
    metrics = paint_metrics(robot.emulator.work.ledger)
    assert robot.onboard.state == TraversalStatus.DONE and metrics.verdict.accepted
    assert metrics.coverage_pct > 99.8 and metrics.double_paint_m2 < 0.02 * TEMPLATE.line_width_m


def test_a_robot_that_is_led_takes_no_other_trajectory_under_way():
    robot = Robot("mpc", 10.0)
    robot.run(8)
    with pytest.raises(CommandRefused, match="others decide how far"):
        robot.emulator.load(planned().trajectory, TEMPLATE, taking=Taking.UNDER_WAY)


def test_without_a_trajectory_there_is_nothing_to_allow():
    with pytest.raises(CommandRefused, match="no trajectory is loaded"):
        Onboard(VEHICLE, OnboardConfig()).authorize(1.0)
