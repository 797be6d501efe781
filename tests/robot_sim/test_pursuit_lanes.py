"""The study's tracker drives lanes to and fro, by a drum with a steered wheel and by two wheels."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.onboard.rig import reversing, start
from touchline.onboard.control.pursuit_lanes import LanePursuitFollower, LaneState
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import COMMAND, EFFECT, LATERAL, REFERENCE_SPEED
from touchline.onboard.trajectory.path import Leg
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import LanePursuit, OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

pytestmark = pytest.mark.xdist_group("roller")  # its kernels are compiled in one worker

LOOK_TICKS = 5
CURVATURE_1PM, BETA_RAD = 0.2731, 0.7961
ARC_M = BETA_RAD / CURVATURE_1PM
LANES = reversing((1, [(0.0, 12.0), (CURVATURE_1PM, ARC_M), (-CURVATURE_1PM, ARC_M)]), (-1, [(0.0, 12.0)]))
NOTHING = Template(name="lanes", segments=(TemplateSegment(id="x", line=LineSpec(start=(0, 0), end=(1, 0))),))


def driven(pause_tick: int = 0, **settings: object) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances from the path [m] and speeds [m/s] along the lanes, every LOOK_TICKS, and to their end."""
    config = OnboardConfig(follower="pursuit-lanes", lane_pursuit=LanePursuit.model_validate(settings))
    robot = Emulator(CLAY_ROLLER, Scenario(noise="none", seed=1), config)
    robot.load(LANES, NOTHING)
    robot.start()
    seen, runner = [], FastRunner(robot)
    while robot.tick_count < 20_000:
        runner.run(LOOK_TICKS)
        status = robot.onboard.status
        if robot.tick_count == pause_tick > 0:
            robot.onboard.pause()
        if status.state == TraversalStatus.PAUSED and abs(robot.onboard.estimate.speed_mps) < 1e-3:
            robot.onboard.resume()
        if status.state == TraversalStatus.DONE:
            return tuple(np.array(seen).T)
        seen.append((robot.onboard.lateral_error_m, robot.onboard.estimate.speed_mps))
    raise AssertionError(robot.onboard.status)


def test_it_cuts_the_s_as_the_study_does() -> None:
    """By up to 0.71 m in the prototype, which had a lag of the steering besides."""
    off, speed = driven()
    assert 0.6 < np.abs(off).max() < 0.75
    assert np.abs(speed).max() == pytest.approx(1.0, abs=0.01)
    assert speed.min() < -0.95
    assert len(off) * LOOK_TICKS * TICK_S == pytest.approx(17.8 + 12.0 + 2 * 9.05, abs=4.0)


def test_nearer_it_cuts_less_and_after_a_pause_in_a_bend_the_lane_begins_anew() -> None:
    off, speed = driven(pause_tick=1500, lookahead_m=1.5)
    assert np.abs(off).max() < 0.2
    stood = int(np.flatnonzero(np.abs(speed[300:]) < 0.01)[0]) + 300
    assert 0.3 < speed[stood + 120] < 0.6


def test_quiet_ticks_are_the_same_as_ticks_one_by_one() -> None:
    robots = [Emulator(CLAY_ROLLER, Scenario(seed=4), OnboardConfig(follower="pursuit-lanes")) for _ in range(2)]
    for robot in robots:
        robot.load(LANES, NOTHING)
        robot.start()
    for _ in range(1500):
        robots[0].tick()
    FastRunner(robots[1]).run(1500)
    assert robots[0].onboard.status.arc_length_m > 5.0
    assert robots[0].world.state.array.tobytes() == robots[1].world.state.array.tobytes()


@dataclass
class Standing:
    """A course on which the robot stands at the begin of a leg."""

    leg: Leg
    pieces: NDArray[np.float64]
    arc_length_m: float


def test_it_may_wait_for_the_steering() -> None:
    vehicle = CLAY_ROLLER
    plan = load_trajectory(reversing((1, [(0.25, 4.0)]), (-1, [(0.0, 4.0)])), vehicle)
    follower, now = LanePursuitFollower(vehicle), np.zeros(COMMAND + 2)
    follower.configure(OnboardConfig(lane_pursuit=LanePursuit(steer_first=True, lookahead_m=2.0)))
    follower.take_path(Standing(plan.legs[0], plan.pieces[0], 0.0))
    now[EFFECT], now[REFERENCE_SPEED] = 0.4, 0.05
    ahead = np.zeros((follower.ahead_rows, 2))
    for _ in range(200):
        twist = follower.step(now, ahead)
        if follower.state is LaneState.TRAVELLING:
            break
        assert follower.state is LaneState.STABILISING
        assert twist.actuators is not None and twist.actuators[0] == 0.0
        assert abs(twist.actuators[1] - now[COMMAND + 1]) <= drive_of(vehicle).reach[1] + 1e-12
        now[COMMAND : COMMAND + 2] = twist.actuators
    assert now[COMMAND + 1] == pytest.approx(-math.atan(2.0 * 0.25), abs=0.02)
    assert twist.yaw_rate_radps / twist.speed_mps == pytest.approx(0.25, rel=1e-3)


def test_sent_back_it_goes_by_the_reference_and_steers_for_a_point_behind() -> None:
    vehicle = CLAY_ROLLER
    plan = load_trajectory(reversing((1, [(0.0, 20.0)])), vehicle)
    follower, now = LanePursuitFollower(vehicle), np.zeros(COMMAND + 2)
    follower.take_path(Standing(plan.legs[0], plan.pieces[0], 10.0))
    now[REFERENCE_SPEED], now[LATERAL] = -0.3, 0.5
    twist = follower.step(now, np.zeros((follower.ahead_rows, 2)))
    assert twist.speed_mps == -0.3
    assert twist.yaw_rate_radps == pytest.approx(-0.3 * 2.0 * -0.5 / (5.0**2 + 0.5**2))


def test_two_wheels_drive_lanes_and_turn_on_the_spot_between_them() -> None:
    run = start(reversing((1, [(0.0, 4.0)]), math.pi / 2, (-1, [(0.0, 3.0)])), "pursuit-lanes")
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
    run.ticks(100)
    assert run.onboard.state == TraversalStatus.DONE, run.onboard.status
    assert math.dist((run.rig.x, run.rig.y), (4.0, -3.0)) < 0.05
