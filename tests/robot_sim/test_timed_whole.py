"""Followers that keep the plan's time drive the emulated marker and the roller: on their path, and by the second."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks._joints import interrupted, joints
from tests.onboard.rig import chain, clothoid, reversing, trajectory
from tests.with_full import with_full
from touchline.onboard.interface import TICK_S
from touchline.schemas.messages import Actuation, Trajectory, TraversalStatus
from touchline.schemas.onboard import OnboardConfig, TrackingGains
from touchline.schemas.scenario import Ground, Scenario
from touchline.schemas.template import LineSpec, Template, TemplateSegment
from touchline.schemas.trajectories import assemble, velocity
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner

pytestmark = pytest.mark.xdist_group("roller")  # its kernels are compiled in one worker

NOTHING = Template(name="lanes", segments=(TemplateSegment(id="x", line=LineSpec(start=(0, 0), end=(1, 0))),))
BEND = [*clothoid(0.27, 0.1, 6), (0.27, 2.0), *clothoid(0.27, 0.1, 6)[::-1]]
LANES = reversing((1, [(0.0, 6.0), *BEND]), (-1, [(0.0, 8.0)]), (1, [(0.0, 5.0)]), speed=2.0)
MARKED = trajectory(
    chain((0.0, 5.0), *clothoid(0.8, 0.8, 8), (0.8, 2.0), *clothoid(0.8, 0.8, 8)[::-1], (0.0, 4.0)),
    sprays=((4.0, 8.0),),
)
SLOWER = 0.9 * math.sqrt(CLAY_ROLLER.drive.max_acceleration_mps2)
"""Speeds that are so much less make the accelerations of the lanes, 1 m/s², the roller's."""
TO_AND_FRO = assemble(
    list(LANES.path.segments),
    [(0.0, Actuation.NONE)],
    [velocity(each.arc_length, SLOWER * each.velocity.value) for each in LANES.velocity_profile.parameters],
)
CLAY = Scenario(seed=3, ground=Ground(surface="clay"))


def robot(vehicle: Vehicle, plan: Trajectory, follower: str, scenario: Scenario, **gains: float) -> Emulator:
    emulator = Emulator(vehicle, scenario, OnboardConfig(follower=follower, tracking=TrackingGains(**gains)))
    emulator.load(plan, NOTHING)
    emulator.start()
    return emulator


def driven(emulator: Emulator) -> tuple[float, np.ndarray]:
    """Delay of its arrival [s], and its distances from the path [m]."""
    while emulator.onboard._traversal.job.aligning:
        emulator.tick()
    begun, off, runner = emulator.tick_count, [], FastRunner(emulator)
    while emulator.onboard.state == TraversalStatus.RUNNING:
        runner.step(10, UNLOGGED)
        off.append(emulator.onboard.lateral_error_m)
    assert emulator.onboard.state == TraversalStatus.DONE, emulator.onboard.status
    planned_s = emulator.onboard._traversal.job.plan.total_time_s
    return (emulator.tick_count - begun) * TICK_S - planned_s, np.abs(off)


@pytest.mark.parametrize("follower", with_full("regularised", "dynamic", full=("nonlinear", "linear-scaled")))
def test_the_marker_keeps_to_its_line_and_to_the_time(follower: str) -> None:
    late_s, off = driven(robot(Vehicle(), MARKED, follower, Scenario(seed=3), frequency_radps=2.0))
    assert abs(late_s) < 0.1
    assert np.percentile(off, 95) < 0.02


@pytest.mark.parametrize("follower", with_full("regularised", full=("nonlinear", "linear-scaled")))
def test_the_roller_keeps_to_its_lane_and_to_the_time(follower: str) -> None:
    late_s, off = driven(robot(CLAY_ROLLER, TO_AND_FRO, follower, CLAY))
    assert abs(late_s) < 0.13
    assert np.percentile(off, 95) < 0.024


def test_frenet_keeps_marker_and_roller_on_their_paths() -> None:
    _, off = driven(robot(Vehicle(), MARKED, "frenet", Scenario(seed=3)))
    assert np.percentile(off, 95) < 0.02
    _, off = driven(robot(CLAY_ROLLER, TO_AND_FRO, "frenet", CLAY, lateral_1pm2=0.5, heading_1ps=1.0))
    assert np.percentile(off, 95) < 0.025


@pytest.mark.parametrize("cause", with_full("e-stop, reset", full=("pause, jolted", "process killed")))
def test_stopped_on_its_way_it_leaves_no_open_joint(cause: str) -> None:
    found = joints(*interrupted(cause, 1, follower="regularised", begins_tick=6000))
    assert len(found) == 3
    assert all(joint.gap_m <= 0.01 and joint.double_m <= 0.02 for joint in found), found


def test_quiet_ticks_are_the_same_as_ticks_one_by_one() -> None:
    plan = reversing((1, [(0.0, 4.0)]), 1.0, (1, [(0.3, 3.0)]), (-1, [(0.0, 2.0)]))
    robots = [robot(Vehicle(), plan, "regularised", Scenario(seed=4)) for _ in range(2)]
    while robots[0].active:
        robots[0].tick()
    FastRunner(robots[1]).run(20_000)
    assert robots[0].tick_count == robots[1].tick_count
    assert robots[0].onboard.state == TraversalStatus.DONE
    assert robots[0].world.pose == robots[1].world.pose
    assert robots[0].onboard.estimate.east_m == robots[1].onboard.estimate.east_m
