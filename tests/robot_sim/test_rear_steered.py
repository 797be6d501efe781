"""The roller on clay: circles, steering, faults; and the robot's computer drives it, forward and backward."""

import json
import math

import numpy as np
import pytest

from tests.onboard.rig import clothoid, reversing
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.interface import TICK_S, Command
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.schemas.onboard import DriveSheet, OnboardConfig
from touchline.schemas.scenario import DriveNoise, Ground, Scenario
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.fault_timeline import FaultTimeline
from touchline.services.robot_sim.world.constants import SURFACES
from touchline.services.robot_sim.world.world import World

pytestmark = pytest.mark.xdist_group("roller")  # its kernels are compiled in one worker

DRIVE = CLAY_ROLLER.drive
LEVEL = Scenario(noise="none", ground=Ground(surface="clay"))
CLAY = SURFACES["clay"]
ONBOARD = DriveSheet(slip_relative=0.03)


def driven(command: tuple[float, float], ticks: int, *faults: str, scenario: Scenario = LEVEL) -> World:
    world, timeline = World(CLAY_ROLLER, scenario), FaultTimeline(map(parse_fault, faults), DRIVE)
    for tick in range(1, ticks + 1):
        timeline.step(tick)
        world.step(Command(command, False, False), tick, timeline.effects)
    return world


@pytest.mark.parametrize("steering_rad", [-0.5, -0.2, 0.35, 0.5])
@pytest.mark.parametrize("drum_radps", [-0.25, 0.25])
def test_slowly_it_drives_the_circle_that_its_steering_means(drum_radps: float, steering_rad: float) -> None:
    """κ = −tan δ/L both ways; the rear wheel's own resistance takes it a little straighter: 0.12/16 of the angle."""
    world = driven((drum_radps, steering_rad), 800)
    speed, yaw_rate = world.state.speed_mps, world.state.yaw_rate_radps
    given = steering_rad * (1.0 - CLAY.rolling / CLAY.stiffness_y)
    assert yaw_rate / speed == pytest.approx(-math.tan(given) / DRIVE.wheelbase_m, rel=2e-3)
    before = world.pose
    for tick in range(801, 1601):
        world.step(Command((drum_radps, steering_rad), False, False), tick)
    after, turned = world.pose, yaw_rate * 8.0
    chord = 2.0 * speed / yaw_rate * math.sin(0.5 * turned)
    moved = math.hypot(after.east_m - before.east_m, after.north_m - before.north_m)
    assert moved == pytest.approx(abs(chord), rel=1e-3)
    assert after.heading_rad - before.heading_rad == pytest.approx(turned, rel=1e-3)


def test_what_the_drum_loses_is_what_rolling_asks_of_its_grip() -> None:
    world = driven((1.0, 0.0), 600)
    push = CLAY.rolling / DRIVE.drum_load_share
    slip = push / CLAY.stiffness_x / math.sqrt(1.0 - (push / CLAY.grip) ** 2)
    assert 1.0 - world.state.speed_mps / (world.drive.rate_radps * DRIVE.drum_radius_m) == pytest.approx(slip, rel=0.01)
    assert world.drive.traction_n == pytest.approx(CLAY.rolling * CLAY_ROLLER.mass_full_kg * GRAVITY_MPS2, rel=0.01)


def test_in_a_curve_drum_and_wheel_slip_aside_as_their_loads_ask() -> None:
    """Each bears its share of the mass, so both slip by the same angle, and the circle stays what it was."""
    state = driven((2.5, 0.3), 1500).state
    across = state.speed_mps * state.yaw_rate_radps
    assert state.side_speed_mps / state.speed_mps == pytest.approx(
        -across / (GRAVITY_MPS2 * CLAY.stiffness_y), rel=0.15
    )


def test_the_steering_keeps_to_its_rate_and_then_to_its_lag() -> None:
    world, angles = World(CLAY_ROLLER, LEVEL), [0.0]
    for tick in range(1, 301):
        world.step(Command((0.0, 0.5), False, False), tick)
        angles.append(float(world.state.angles_rad[1]))
    rates = np.diff(angles) / TICK_S
    assert rates.max() == pytest.approx(DRIVE.steering_rate_limit_radps, rel=1e-6)
    left = 0.5 - np.array(angles)
    lagging = left < 0.9 * DRIVE.steering_rate_limit_radps * DRIVE.steering_time_constant_s
    shares = left[1:][lagging[:-1]] / left[:-1][lagging[:-1]]
    assert shares == pytest.approx(math.exp(-TICK_S / DRIVE.steering_time_constant_s), rel=1e-6)
    assert world.pose == (0.0, 0.0, 0.0), "a standing roller stays where it is"
    world.step(Command((0.0, 9.0), False, False), 301)
    assert driven((0.0, 9.0), 400).state.angles_rad[1] == pytest.approx(DRIVE.steering_stop_rad, rel=1e-3)


@pytest.mark.parametrize("heading", [0.0, 1.0, math.pi])
def test_it_stands_on_a_slope(heading: float) -> None:
    world = World(CLAY_ROLLER, Scenario(noise="none", ground=Ground(surface="clay", grade=0.1)))
    world.place(world.pose._replace(heading_rad=heading))
    before = world.pose
    for tick in range(1, 301):
        world.step(Command((0.0, 0.2), False, False), tick)
    assert world.pose == before


def test_its_offset_is_of_the_seed_and_of_a_blow() -> None:
    offsets = [
        World(CLAY_ROLLER, LEVEL.model_copy(update={"noise": "default", "seed": seed})).figures.drive.offset_rad
        for seed in range(200)
    ]
    assert np.std(offsets) == pytest.approx(DriveNoise().steering_offset_rad, rel=0.15)
    world = driven((0.5, 0.0), 800, '{"kind": "steering-offset", "actuator": "steering", "offset_rad": 0.1}')
    assert world.state.angles_rad[1] == 0.0
    curvature = world.state.yaw_rate_radps / world.state.speed_mps
    assert curvature == pytest.approx(-math.tan(0.1) / DRIVE.wheelbase_m, rel=0.02)


@pytest.mark.parametrize(
    ("fault", "speed_mps", "steering_rad"),
    [
        ('{"kind": "wheel-blocked", "actuator": "drum"}', 0.0, 0.3),
        ('{"kind": "wheel-blocked", "actuator": "steering"}', 0.394, 0.0),
        ('{"kind": "wheel-slip", "actuator": "drum", "share": 0.25}', 0.295, 0.3),
        ('{"kind": "motor-weak", "actuator": "steering", "share": 0.1}', 0.394, 0.0575 * 3.0),
        ('{"kind": "motor-weak", "actuator": "drum", "share": 0.0}', 0.0, 0.3),
    ],
)
def test_faults_are_of_its_actuators(fault: str, speed_mps: float, steering_rad: float) -> None:
    state = driven((1.0, 0.3), 300, fault).state
    assert state.speed_mps == pytest.approx(speed_mps, abs=0.005)
    assert state.angles_rad[1] == pytest.approx(steering_rad, abs=0.001)


def test_a_steered_wheel_without_grip_no_longer_leads() -> None:
    sure, slippery = (
        driven((1.0, 0.4), 800, *faults).state
        for faults in ((), ('{"kind": "wheel-slip", "actuator": "steering", "share": 0.95}',))
    )
    assert abs(slippery.yaw_rate_radps - sure.yaw_rate_radps) > 0.2 * abs(sure.yaw_rate_radps)


def test_an_empty_battery_moves_nothing() -> None:
    world = World(CLAY_ROLLER, LEVEL)
    world.state.battery_wh = 0.0
    for tick in range(1, 101):
        world.step(Command((1.0, 0.3), False, False), tick)
    assert (world.state.speed_mps, world.state.angles_rad[1]) == (0.0, 0.0)


BEND = (*clothoid(0.25, 1.5, 12), (0.25, 1.0), *clothoid(0.25, 1.5, 12)[::-1])
COUNTER = tuple((-curvature, length) for curvature, length in BEND)
THERE_AND_BACK = reversing((1, [(0.0, 5.0), *BEND, *COUNTER, (0.0, 4.0)]), (-1, [(0.0, 5.0), *BEND, (0.0, 5.0)]))


SLID_ASIDE = reversing((1, [(0.0, 4.0), (0.27, 2.9), (-0.27, 2.9), (0.0, 4.0)]), (-1, [(0.0, 12.0)]))
"""Onto the next lane as the zigzag does: full left to full right at once, which no steering can."""


def sent(
    follower: str,
    noise: str = "default",
    faults: tuple[dict[str, object], ...] = (),
    trajectory: Trajectory = THERE_AND_BACK,
) -> Emulator:
    scenario = Scenario.model_validate(
        {"noise": noise, "seed": 4, "ground": {"surface": "clay"}, "faults": json.loads(json.dumps(faults))}
    )
    robot = Emulator(CLAY_ROLLER, scenario, OnboardConfig(follower=follower, drive=ONBOARD))
    robot.load(trajectory)
    robot.start()
    return robot


def driven_to_the_end(robot: Emulator) -> tuple[np.ndarray, np.ndarray]:
    """It never pauses; distances from its path [m] and speeds [m/s], ten times a second."""
    runner, seen = FastRunner(robot), []
    while robot.active:
        runner.run(10)
        assert robot.onboard.status.state != TraversalStatus.PAUSED, robot.onboard.status.reason
        job = robot.onboard._traversal.job
        assert job is not None
        seen.append((abs(job.driver.now[0]), robot.world.state.speed_mps))
    assert (robot.onboard.status.state, robot.onboard.status.reason) == (TraversalStatus.DONE, "")
    off, speeds = np.array(seen).T
    return off, speeds


@pytest.mark.parametrize("follower", ["pure-pursuit", "mpc"])
def test_both_followers_drive_it_both_ways(follower: str) -> None:
    robot = sent(follower)
    off, speeds = driven_to_the_end(robot)
    assert robot.onboard.status.follower_fallbacks == 0
    assert speeds.max() > 0.7 and speeds.min() < -0.7
    assert np.percentile(off, 95) < 0.015 and off.max() < 0.04
    assert robot.work.estimator_error.position_rmse_m < 0.016


def test_the_mpc_does_not_weave_after_a_step_of_curvature() -> None:
    off, _ = driven_to_the_end(sent("mpc", trajectory=SLID_ASIDE))
    assert np.percentile(off, 95) < 0.022 and off.max() < 0.04


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"kind": "wheel-blocked", "actuator": "steering"}, "the steering does not turn as commanded"),
        ({"kind": "motor-weak", "actuator": "steering", "share": 0.1}, "the steering does not turn as commanded"),
        ({"kind": "wheel-blocked", "actuator": "drum"}, "the drum does not turn as commanded"),
    ],
)
def test_what_does_not_obey_stops_it(fault: dict[str, object], words: str) -> None:
    robot = sent("mpc", faults=({**fault, "start_s": 12.0},))
    runner = FastRunner(robot)
    while robot.active and robot.onboard.state != TraversalStatus.PAUSED and robot.tick_count < 4000:
        runner.run(20)
    assert (robot.onboard.state, robot.onboard.status.reason) == (TraversalStatus.PAUSED, words)
    runner.run(1500)
    assert abs(robot.world.state.speed_mps) < 0.01


@pytest.mark.parametrize("start_s", [8.0, 26.0], ids=["under way", "when it is about to set off backward"])
def test_a_blow_to_the_steering_is_found_and_made_up_for(start_s: float) -> None:
    robot = sent("mpc", faults=({"kind": "steering-offset", "actuator": "steering", "start_s": start_s},))
    off, _ = driven_to_the_end(robot)
    assert off.max() < 0.05
