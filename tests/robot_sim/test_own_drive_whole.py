"""A drive of somebody else plans, drives and paints a pitch, and no file but its own knows it."""

from collections.abc import Iterator

import pytest

from tests.planner.drum_drive import DrumDrive
from tests.robot_sim.crawler import registered
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

pytestmark = pytest.mark.xdist_group("drum")  # what is compiled for it is not kept on disk
ROLLER = Vehicle(name="roller", drive=DrumDrive(transit_speed_mps=1.2))


@pytest.fixture(autouse=True)
def drum() -> Iterator[None]:
    with registered():
        yield


def painted(follower: str) -> Emulator:
    template = load_template("study-square")
    trajectory = plan(template, ROLLER, PlanOptions(forward_only=True)).trajectory
    robot = Emulator(ROLLER, Scenario(noise="none", seed=3), OnboardConfig(follower=follower))
    robot.load(trajectory, template)
    robot.start()
    FastRunner(robot).run(200_000)
    return robot


@pytest.mark.parametrize("follower", ["pure-pursuit"])
def test_it_paints_a_template(follower: str) -> None:
    robot = painted(follower)
    status, figures = robot.onboard.status, robot.metrics()
    assert (status.state, status.reason) == (TraversalStatus.DONE, "")
    assert figures.coverage_pct > 99.0
    assert figures.lateral.p95_m < 0.03
    assert robot.estimator_error.position_rmse_m < 0.02


def test_tick_by_tick_it_is_the_same() -> None:
    template = load_template("study-square")
    trajectory = plan(template, ROLLER, PlanOptions(forward_only=True)).trajectory
    robots = [Emulator(ROLLER, Scenario(seed=3), OnboardConfig(follower="pure-pursuit")) for _ in range(2)]
    for robot in robots:
        robot.load(trajectory, template)
        robot.start()
    for _ in range(1000):
        robots[0].tick()
    FastRunner(robots[1]).run(1000)
    assert robots[0].world.state.array.tobytes() == robots[1].world.state.array.tobytes()
    assert robots[0].onboard.estimate[:5] == robots[1].onboard.estimate[:5]
