"""Pure pursuit slows down by itself where a trajectory from elsewhere asks for too much, and only there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.onboard.rig import chain, trajectory
from touchline.onboard import tracking_state as tracking
from touchline.onboard.control.pure_pursuit import FAR_M, PurePursuitFollower
from touchline.onboard.drives.onboard_drive import Aim
from touchline.onboard.trajectory import path_projection as projection
from touchline.schemas.curves import PathTable
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator

SPEED_MPS = 1.5
CURVATURE_1PM = 1.15
IN_M, ARC_M, OUT_M = 6.0, 2.5, 5.0
CURVES = chain((0.0, IN_M), (CURVATURE_1PM, ARC_M), (0.0, OUT_M))
VEHICLE = Vehicle()
BOLD = VEHICLE.changed(drive={"max_lateral_acceleration_mps2": 1e3})
"""As the robot would drive if it took its tyres to hold anything: without regulation by curvature."""
ARC, OFF, SPEED = range(3)


def drive(vehicle: Vehicle = VEHICLE, noise: str = "none", start: Pose2 | None = None) -> np.ndarray:
    """(ticks, 3): arc length [m], true distance of the axle from the path [m], true speed [m/s]."""
    scenario, config = Scenario.model_validate({"noise": noise, "start": start}), OnboardConfig(follower="pure-pursuit")
    emulator, table, found = Emulator(vehicle, scenario, config), PathTable.from_curves(CURVES), []
    emulator.load(trajectory(CURVES, speed=SPEED_MPS))
    emulator.start()
    while emulator.active and emulator.tick_count < 3000:
        emulator.tick()
        arc, pose = emulator.onboard.status.arc_length_m, emulator.world.pose
        x, y, heading, _ = table.at(arc)
        off = (pose.north_m - y) * math.cos(heading) - (pose.east_m - x) * math.sin(heading)
        found.append((arc, abs(off), emulator.world.state.speed_mps))
    assert emulator.onboard.state == TraversalStatus.DONE
    return np.array(found)


def between(run: np.ndarray, from_m: float, to_m: float) -> np.ndarray:
    """The ticks of a run from one arc length to another."""
    return run[(run[:, ARC] > from_m) & (run[:, ARC] < to_m)]


@pytest.mark.parametrize("noise", ["default", pytest.param("none", marks=pytest.mark.full)])
def test_a_curve_too_tight_for_its_speed_is_driven_slower_and_kept(noise: str) -> None:
    wild, sober = (between(drive(vehicle, noise), IN_M - 0.5, IN_M + ARC_M + 2.0) for vehicle in (BOLD, VEHICLE))
    held_mps = math.sqrt(1.25 * VEHICLE.drive.max_lateral_acceleration_mps2 / CURVATURE_1PM)
    turning = between(sober, IN_M + 0.5, IN_M + ARC_M - 0.2)
    assert turning[:, SPEED].max() < 1.03 * held_mps
    assert turning[:, SPEED].min() > 0.85 * held_mps
    assert sober[:, OFF].max() < 0.016
    assert sober[:, OFF].max() < wild[:, OFF].max()


def test_where_nothing_asks_for_it_the_speed_is_the_plans() -> None:
    run = drive()
    assert between(run, 2.0, IN_M - 1.0)[:, SPEED] == pytest.approx(SPEED_MPS, abs=0.02)
    assert between(run, IN_M + ARC_M + 2.0, IN_M + ARC_M + 3.0)[:, SPEED] == pytest.approx(SPEED_MPS, abs=0.05)


def test_off_its_path_it_is_slow_until_it_is_back() -> None:
    near, far = drive(), drive(start=Pose2(x_m=0.0, y_m=0.2, heading_rad=0.0))
    place = (0.2, 0.7)
    assert between(far, *place)[:, SPEED].mean() < 0.8 * between(near, *place)[:, SPEED].mean()
    assert between(far, 2.0, IN_M)[:, OFF].max() < 0.02


@pytest.mark.parametrize(("off_m", "slower"), [(0.02, False), (FAR_M, True)])
def test_distance_alone_makes_it_slower(off_m: float, slower: bool) -> None:
    now = np.zeros(tracking.COMMAND + 2)
    now[[tracking.EFFECT, tracking.EFFECT + 1]] = VEHICLE.drive.wheel_radius_m
    now[[tracking.SPEED, tracking.REFERENCE_SPEED]] = 1.0
    now[tracking.NOZZLE_LATERAL] = off_m
    now[tracking.HEADING_ERROR] = math.atan2(-off_m, Aim().lookahead_s)  # aims where it goes: no curvature
    follower = PurePursuitFollower(VEHICLE)
    ahead = np.zeros((follower.ahead_rows, projection.AHEAD_COLUMNS))
    ahead[:, projection.A_SPEED] = 1.0
    for _ in range(10):
        speed_mps, yaw_rate_radps, _ = follower.step(now, ahead)
    assert yaw_rate_radps == pytest.approx(0.0, abs=1e-9)
    assert (speed_mps < 0.9) if slower else speed_mps == pytest.approx(1.0)
