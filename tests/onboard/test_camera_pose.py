"""A camera's poses in the filter: as fixes with a heading, late, twice, out of order, wild and contradictory."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.special import chdtri

from benchmarks.positioning import OpenLoopRobot, settings
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.estimation.filter import JUMP_RUN, Estimator
from touchline.onboard.interface import CameraSample, ImuSample, MagSample, SensorFrame
from touchline.schemas.faults import MessagesDuplicated, MessagesLate, MessagesReordered
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles.shipped import SHIPPED

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker

TURTLEBOT = SHIPPED["turtlebot2"].vehicle
RUNS = 6


def standing(tick: int, *poses: CameraSample) -> SensorFrame:
    imu, mag = ImuSample(0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY_MPS2), MagSample(0.0, 1.7e-5, -4.8e-5)
    return SensorFrame(tick, tick / 100, imu, mag, (0.0, 0.0), camera=poses)


def pose(tick: int, east_m: float = 2.0, heading_rad: float = 3.0) -> CameraSample:
    return CameraSample(tick / 100 - 0.08, east_m, -1.0, heading_rad, 0.01, math.radians(1.0))


def settled() -> tuple[Estimator, int]:
    """One that has stood for two seconds, and the next tick."""
    estimator = Estimator(TURTLEBOT, OnboardConfig())
    for tick in range(1, 201):
        estimator.step(standing(tick, *((pose(tick),) if tick % 7 == 0 and tick > 8 else ())))
    return estimator, 201


def test_position_and_heading_are_known_at_once() -> None:
    estimator = Estimator(TURTLEBOT, OnboardConfig())
    for tick in range(1, 60):
        estimator.step(standing(tick, *((pose(tick),) if tick % 7 == 0 and tick > 8 else ())))
        if estimator.aligned:
            break
    assert tick < 50
    assert estimator.state[:2] == pytest.approx([2.0, -1.0], abs=1e-6)
    assert math.remainder(estimator.state[2] - 3.0, math.tau) == pytest.approx(0.0, abs=0.005)
    assert estimator.heading_sigma_rad < math.radians(1.0)


def test_a_wild_pose_moves_nothing_and_a_flipped_one_is_at_its_place() -> None:
    estimator, tick = settled()
    before = estimator.state[:3].copy()
    estimator.step(standing(tick, pose(tick, east_m=3.0)))
    assert np.abs(estimator.state[:2] - before[:2]).max() < 1e-3
    estimator.step(standing(tick + 1, pose(tick + 1, heading_rad=3.0 - math.pi)))
    assert estimator.state[2] == pytest.approx(before[2], abs=1e-4)
    assert estimator.counters.headings_rejected == 1
    assert not estimator.contradicted


@pytest.mark.parametrize("wrong", [{"east_m": 2.3}, {"heading_rad": 0.0}])
def test_a_lasting_error_is_a_contradiction_and_can_be_accepted(wrong: dict[str, float]) -> None:
    estimator, tick = settled()
    ticks = itertools.count(tick)
    for at in itertools.islice(ticks, 7 * (JUMP_RUN + 1)):
        estimator.step(standing(at, *((pose(at, **wrong),) if at % 7 == 0 else ())))
    assert estimator.contradicted
    estimator.accept_jump()
    assert not estimator.contradicted
    for at in itertools.islice(ticks, 30):
        estimator.step(standing(at, *((pose(at, **wrong),) if at % 7 == 0 else ())))
    told = {"east_m": 2.0, "heading_rad": 3.0} | wrong
    assert estimator.state[0] == pytest.approx(told["east_m"], abs=1e-3)
    assert math.remainder(estimator.state[2] - told["heading_rad"], math.tau) == pytest.approx(0.0, abs=1e-2)


@pytest.mark.parametrize(
    "fault",
    [
        MessagesLate(kind="messages-late", sensor="camera", delay_s=0.2),
        MessagesReordered(kind="messages-reordered", sensor="camera", spread_s=0.3),
        MessagesDuplicated(kind="messages-duplicated", sensor="camera", after_s=0.05),
    ],
)
def test_late_poses_end_in_the_estimate_of_prompt_ones(
    fault: MessagesLate | MessagesReordered | MessagesDuplicated,
) -> None:
    vehicle, scenario, config = settings("turtlebot2", 4)
    lasting = fault.model_copy(update={"start_s": 2.0, "duration_s": 4.0})
    prompt = OpenLoopRobot(vehicle, scenario, config)
    late = OpenLoopRobot(vehicle, scenario.model_copy(update={"faults": (lasting,)}), config)
    for _ in range(700):
        prompt.step()
        late.step()
    assert late.estimator.state == pytest.approx(prompt.estimator.state, rel=1e-9, abs=1e-12)
    counters = late.estimator.counters
    assert counters.fixes_late == 0
    assert (counters.fixes_duplicate if fault.kind == "messages-duplicated" else counters.fixes) > 30
    assert counters.fixes_out_of_order > 0 or fault.kind != "messages-reordered"


@pytest.mark.parametrize("name", ["turtlebot3-waffle-pi", pytest.param("turtlebot2", marks=pytest.mark.full)])
def test_the_estimate_is_as_good_as_it_says_and_through_an_outage(name: str) -> None:
    nees, nis, heading_nis, blind = [], [], [], []
    for seed in range(1, RUNS + 1):
        robot = OpenLoopRobot(*settings(name, seed, outage=True))
        for tick in range(1, 2501):
            robot.step()
            if 1000 <= tick < 2000 and tick % 100 == 0:
                nees.append(robot.nees)
        n = robot.estimator.counters
        nis.append(n.fix_nis_sum / n.fixes)
        heading_nis.append(n.heading_nis_sum / n.headings)
        blind.append(robot.nees)
        assert robot.within_3_sigma
        assert math.hypot(*robot.error[:2]) < 0.1
    assert np.mean(nees) < chdtri(3 * RUNS, 0.005) / RUNS
    assert np.mean(blind) < chdtri(3 * RUNS, 0.005) / RUNS
    assert np.mean(nis) == pytest.approx(2.1, abs=0.25)
    assert np.mean(heading_nis) == pytest.approx(1.0, abs=0.15)
