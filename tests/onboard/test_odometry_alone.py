"""Odometry alone: from a start that is told, growing unsure honestly, and never stopped for want of fixes."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.positioning import OpenLoopRobot, alone, settings
from touchline.schemas.messages import PlanOptions, PoseGoal, TraversalStatus
from touchline.schemas.onboard import OdometrySheet, OnboardConfig
from touchline.schemas.vehicles import ODOMETRY
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.robot_sim.emulator import Emulator

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker

RUNS = 4


def robot(seed: int, sheet: OdometrySheet) -> OpenLoopRobot:
    vehicle, scenario, config = settings("turtlebot2", seed)
    own = config.model_copy(update={"odometry": sheet})
    return OpenLoopRobot(vehicle.model_copy(update={"positioning": ODOMETRY}), scenario, own)


def test_it_starts_by_itself_where_it_is_told_and_as_sure_as_that() -> None:
    made = robot(1, OdometrySheet(start_sigma_m=0.03, start_sigma_rad=0.02))
    for _ in range(50):
        made.step()
    assert made.estimator.aligned
    assert made.estimator.state[:3] == pytest.approx([0.0, 0.0, 0.0], abs=0.02)
    assert made.estimator.position_sigma_m == pytest.approx(0.03, rel=0.01)
    assert made.estimator.heading_sigma_rad < 0.0201


def test_20_m_end_within_the_3_sigma_that_it_says() -> None:
    ends = alone("turtlebot2", range(1, RUNS + 1))
    assert ends.inside.all()
    assert ends.nees.mean() < 2.0 * 3.0
    assert 0.3 * np.sqrt(2.0) < np.median(ends.off_m / ends.sigma_m) < 2.0, "sure, but not of too little"


def test_the_scale_of_all_ways_is_considered() -> None:
    """It adds the square of the distance from the start, as the crow flies, times the share, to the variance."""
    sure, unsure = (robot(2, OdometrySheet(scale_relative=share)) for share in (0.0, 0.02))
    for _ in range(1500):
        sure.step()
        unsure.step()
    assert unsure.estimator.state == pytest.approx(sure.estimator.state)
    way = unsure.estimator.state[:2]
    added = unsure.estimator.covariance[:2, :2] - sure.estimator.covariance[:2, :2]
    assert added == pytest.approx(0.02**2 * np.outer(way, way), rel=0.02, abs=1e-6)


@pytest.mark.parametrize(("max_sigma_m", "ends"), [(None, TraversalStatus.DONE), (0.02, TraversalStatus.PAUSED)])
def test_it_drives_however_unsure_unless_told_otherwise(max_sigma_m: float | None, ends: int) -> None:
    vehicle, scenario, config = settings("turtlebot2", 3)
    config = config.model_copy(update={"odometry": OdometrySheet(max_sigma_m=max_sigma_m)})
    emulator = Emulator(vehicle.model_copy(update={"positioning": ODOMETRY}), scenario, config)
    goal, options = PoseGoal(x_m=3.0, y_m=1.0, heading_rad=0.5), PlanOptions(start=[0.0, 0.0, 0.0])
    emulator.load(plan_to_goal(goal, vehicle, options).trajectory)
    emulator.start()
    for _ in range(1200):
        emulator.tick()
    assert emulator.onboard.state == ends
    if ends == TraversalStatus.PAUSED:
        assert emulator.onboard.status.reason == "the position is unknown (σ above 0.02 m)"
    else:
        assert emulator.world.pose[:2] == pytest.approx([3.0, 1.0], abs=0.15)


def test_configurations_without_it_are_written_as_before() -> None:
    assert "odometry" not in OnboardConfig().model_dump()
    other = OnboardConfig(odometry=OdometrySheet(max_sigma_m=2.0))
    assert OnboardConfig.model_validate(other.model_dump()) == other
