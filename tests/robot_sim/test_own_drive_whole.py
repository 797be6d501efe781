"""A drive of somebody else plans, drives and paints a pitch, and no file but its own knows it."""

from collections.abc import Iterator
from functools import cache

import pytest

from tests.planner.drum_drive import DrumDrive
from tests.robot_sim.crawler import registered
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions, Trajectory, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

pytestmark = [pytest.mark.full, pytest.mark.xdist_group("drum")]  # what is compiled for it is not kept on disk
TEMPLATE = load_template("study-square")
ROLLER = Vehicle(name="roller", drive=DrumDrive(transit_speed_mps=1.2))


@pytest.fixture(autouse=True)
def drum() -> Iterator[None]:
    with registered():
        yield


@cache
def trajectory() -> Trajectory:
    return plan(TEMPLATE, ROLLER, PlanOptions(forward_only=True)).trajectory


def started(scenario: Scenario) -> Emulator:
    robot = Emulator(ROLLER, scenario, OnboardConfig(follower="pure-pursuit"))
    robot.load(trajectory(), TEMPLATE)
    robot.start()
    return robot


def test_it_paints_a_template() -> None:
    robot = started(Scenario(noise="none", seed=3))
    FastRunner(robot).run(200_000)
    status, figures = robot.onboard.status, robot.metrics()
    assert (status.state, status.reason) == (TraversalStatus.DONE, "")
    assert figures.coverage_pct > 99.0
    assert figures.lateral.p95_m < 0.03
    assert robot.estimator_error.position_rmse_m < 0.02


def test_tick_by_tick_it_is_the_same() -> None:
    robots = [started(Scenario(seed=3)) for _ in range(2)]
    for _ in range(1000):
        robots[0].tick()
    FastRunner(robots[1]).run(1000)
    assert robots[0].world.state.array.tobytes() == robots[1].world.state.array.tobytes()
    assert robots[0].onboard.estimate[:5] == robots[1].onboard.estimate[:5]
