"""A guided robot: it drives to targets within cells, brakes when nobody hears it, and obeys the operator as ever."""

from __future__ import annotations

import math
from operator import itemgetter

import numpy as np
import pytest

from tests.plan_limits import LIMITS
from touchline import onboard
from touchline.coordination.plans import plan_kernels
from touchline.core import timed_motion
from touchline.onboard.estimation.claimed_covariance import claim_pose
from touchline.onboard.executive.dead_reckoning import APART_SIGMAS, dead_reckoning, speed_to_rest_within
from touchline.schemas.errors import CommandRefused
from touchline.schemas.faults import CameraOutage, ImuBias
from touchline.schemas.messages import Guidance, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER, SHIPPED, on_its_ground, with_its_own
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry

NAME = "turtlebot2"
ROOM = np.array([(1.0, 0.0, 3.0), (-1.0, 0.0, -0.9), (0.0, 1.0, 2.0), (0.0, -1.0, -0.9)])
"""A cell from 0.9 m to 3 m and 2 m."""
LEASE_S = OnboardConfig().team.lease_s
MARGIN_M = 0.023


def guided(
    start: tuple[float, float, float] = (1.0, 1.0, 2.0), *, plans: bool = False, margin_m: float = 0.0
) -> Emulator:
    """A robot that has just been told to be guided."""
    x_m, y_m, heading_rad = start
    world = Scenario(start=Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    robot = Emulator(SHIPPED[NAME].vehicle, on_its_ground(NAME, world), with_its_own(NAME, OnboardConfig()))
    robot.begin_guided(plans=plans, margin_m=margin_m)
    return robot


def aligned(robot: Emulator) -> Emulator:
    """Once it knows where it is."""
    while not (robot.onboard.whereabouts or robot.onboard.plan_state).aligned:
        robot.tick()
        assert robot.tick_count < 1000
    return robot


def tell(robot: Emulator, number: int, x_m: float, y_m: float, cell: np.ndarray = ROOM) -> None:
    stamp_s = robot.onboard.whereabouts.stamp_s
    told = Guidance(number=number, echo_s=stamp_s, target_x_m=x_m, target_y_m=y_m, half_planes=cell.ravel())
    robot.onboard.take_guidance(told)


def off(robot: Emulator, x_m: float, y_m: float) -> float:
    return math.hypot(robot.world.pose.east_m - x_m, robot.world.pose.north_m - y_m)


def drive(robot: Emulator, ticks: int, x_m: float, y_m: float) -> list[tuple[float, float]]:
    """Towards a target, told anew five times a second; where it truly was in every tick."""
    runner, places, first = FastRunner(robot), [], robot.tick_count
    rows = np.zeros((20, tick_log.columns(2)))
    while robot.tick_count < first + ticks:
        if robot.tick_count % 20 == 0:
            tell(robot, robot.tick_count, x_m, y_m)
        runner.step(20 - robot.tick_count % 20, rows)
        places.append(tuple(robot.world.pose[:2]))
    return places


def test_it_stands_until_it_is_told_a_cell_and_comes_to_rest_at_its_target() -> None:
    robot = aligned(guided())
    for _ in range(200):
        robot.tick()
    assert off(robot, 1.0, 1.0) < 1e-3
    assert robot.onboard.whereabouts.adopted == 0
    drive(robot, 1000, 2.5, 1.6)
    assert off(robot, 2.5, 1.6) < 0.02
    assert abs(robot.world.state.speed_mps) < 1e-3
    assert robot.onboard.status.state == TraversalStatus.RUNNING


def test_it_stops_at_the_side_of_its_cell_however_far_the_target_is() -> None:
    robot = aligned(guided())
    places = np.array(drive(robot, 1200, 9.0, 1.5))
    assert (places @ ROOM[:, :2].T - ROOM[:, 2]).max() < 0.015
    assert places[-1][0] > 2.95


def test_it_brakes_when_its_lease_is_over_and_drives_on_when_it_is_heard_again() -> None:
    robot = aligned(guided())
    drive(robot, 300, 2.9, 1.0)
    assert robot.world.state.speed_mps > 0.2
    far = np.array([(1.0, 0.0, 9.0)])
    tell(robot, 10_000, 8.0, 1.0, far)
    for _ in range(round(100 * LEASE_S) - 5):
        robot.tick()
    assert robot.world.state.speed_mps > 0.45
    for _ in range(110):
        robot.tick()
    assert abs(robot.world.state.speed_mps) < 0.02
    tell(robot, 10_001, 8.0, 1.0, far)
    for _ in range(100):
        robot.tick()
    assert robot.world.state.speed_mps > 0.3


def test_a_robot_that_forgets_its_cell_brakes_on_its_stopping_segment_and_takes_new_ones_from_the_first_on() -> None:
    robot = aligned(guided((1.0, 1.0, 0.0)))
    drive(robot, 200, 2.9, 1.0)
    assert robot.world.state.speed_mps > 0.4
    said = robot.onboard.whereabouts
    robot.forget_cell()
    for _ in range(150):
        tell(robot, 0, 0.0, 0.0, np.zeros((0, 3)))
        robot.tick()
        now = robot.onboard.whereabouts
        assert (now.adopted, now.decided) == (0, 0)
        assert said.x_m <= now.x_m <= now.stop_x_m + 1e-3
        assert now.stop_x_m <= said.stop_x_m + 0.006, "but for the error of the pose it brakes on the same segment"
        assert abs(now.y_m - said.y_m) + abs(now.stop_y_m - said.stop_y_m) < 0.02, "likewise"
    assert abs(robot.world.state.speed_mps) < 1e-3
    tell(robot, 1, 2.5, 1.6)
    assert robot.onboard.whereabouts.adopted == 1
    drive(robot, 1000, 2.5, 1.6)
    assert off(robot, 2.5, 1.6) < 0.02
    names = [order.name for order in robot.orders.take()]
    assert names.count("forget-cell") == 1


def test_a_cell_that_it_is_not_in_is_refused_for_ever() -> None:
    robot = aligned(guided())
    elsewhere = np.array([(1.0, 0.0, 0.5)])
    tell(robot, 7, 0.2, 1.0, elsewhere)
    said = robot.onboard.whereabouts
    assert (said.adopted, said.decided) == (0, 7)
    tell(robot, 6, 2.0, 1.0)
    assert robot.onboard.whereabouts.adopted == 0
    tell(robot, 8, 2.0, 1.0)
    assert robot.onboard.whereabouts.adopted == 8


def test_what_it_says_is_where_it_would_stop() -> None:
    robot = aligned(guided())
    drive(robot, 250, 2.9, 1.0)
    said = robot.onboard.whereabouts
    robot.pause()
    for _ in range(200):
        robot.tick()
    assert math.hypot(said.stop_x_m - said.x_m, said.stop_y_m - said.y_m) > 0.15
    assert off(robot, said.stop_x_m, said.stop_y_m) < 0.02


@pytest.mark.parametrize(("margin_m", "blind_s"), [(0.0, 0.0), (0.012, 2.0)])
def test_ticks_run_fast_are_the_ticks_run_one_by_one(margin_m: float, blind_s: float) -> None:
    """Whole stretches between updates, some of which a fault or a command breaks off."""
    digests, told = [], []
    for fast in (True, False):
        robot = aligned(guided(margin_m=margin_m))
        telemetry, runner, said = Telemetry(robot), FastRunner(robot), list[tuple[str, bytes]]()
        telemetry.begin([])
        for update in range(16):
            tell(robot, 1 + update, 2.5, 1.2 + 0.05 * update)
            if update == 1 and blind_s:
                robot.inject_fault(CameraOutage(kind="camera-outage", duration_s=blind_s))
                telemetry.news()
            elif update == 6:
                robot.inject_fault(ImuBias(kind="imu-bias", start_s=0.13, duration_s=0.05, gyro_radps=0.01))
                telemetry.news()
            elif update == 9:
                robot.pause()
                telemetry.news()
            elif update == 11:
                robot.resume()
                telemetry.news()
            done = 0
            while done < 40:
                count = 1
                if fast:
                    count = runner.step(telemetry.until_due(40 - done), telemetry.rows)
                else:
                    robot.tick()
                telemetry.hold(count)
                done += count
            said += [(topic.name, payload) for topic, payload in telemetry.told()]
        digests.append(telemetry.digest.hexdigest())
        told.append(sorted(said, key=itemgetter(0)))
    assert any(b"waiting for its pose" in payload for _, payload in told[1]) == bool(blind_s)
    assert told[0] == told[1]
    assert digests[0] == digests[1]


def test_the_operator_pauses_stops_and_releases_it() -> None:
    robot = aligned(guided())
    drive(robot, 250, 2.9, 1.0)
    robot.pause()
    drive(robot, 200, 2.9, 1.0)
    assert abs(robot.world.state.speed_mps) < 1e-3
    assert robot.onboard.whereabouts.adopted > 0
    robot.resume()
    drive(robot, 100, 2.9, 1.9)
    robot.estop()
    drive(robot, 100, 2.9, 1.9)
    assert robot.onboard.state == TraversalStatus.ESTOPPED
    assert abs(robot.world.state.speed_mps) < 1e-3
    robot.reset()
    robot.resume()
    drive(robot, 1000, 2.0, 1.9)
    assert off(robot, 2.0, 1.9) < 0.02
    robot.abort()
    assert robot.onboard.whereabouts is None


def test_a_trajectory_takes_over_only_from_a_robot_that_is_not_guided_any_more() -> None:
    robot = aligned(guided(start=(0.0, 0.0, 0.0)))
    plan = onboard.straight(robot.vehicle)
    with pytest.raises(CommandRefused, match="cannot load while running"):
        robot.load(plan)
    with pytest.raises(CommandRefused, match="cannot load while running"):
        robot.begin_guided()
    robot.abort()
    for _ in range(200):
        robot.tick()
    robot.load(plan)
    robot.start()
    FastRunner(robot).run(2000)
    assert robot.onboard.state == TraversalStatus.DONE


def test_a_robot_that_cannot_turn_on_the_spot_is_not_guided() -> None:
    with pytest.raises(CommandRefused, match="cannot turn on the spot"):
        Emulator(CLAY_ROLLER, Scenario()).begin_guided()


def test_a_marker_is_guided_like_any_other_and_sprays_nothing() -> None:
    robot = Emulator(Vehicle(), Scenario(start=Pose2(x_m=1.0, y_m=1.0, heading_rad=0.0)))
    robot.begin_guided()
    aligned(robot)
    field = np.array([(1.0, 0.0, 9.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 9.0), (0.0, -1.0, 0.0)])
    for number in range(1, 40):
        tell(robot, number, 5.0, 4.0, field)
        for _ in range(40):
            robot.tick()
    assert off(robot, 5.0, 4.0) < 0.05
    assert robot.work.ledger.points == 0


def test_a_lost_camera_pauses_it_and_it_goes_on_when_that_sees_it_again() -> None:
    world = Scenario.model_validate(
        {
            "start": {"x_m": 1.0, "y_m": 1.0, "heading_rad": 0.0},
            "ground": {"surface": "floor"},
            "faults": [{"kind": "camera-outage", "start_s": 3.0, "duration_s": 60.0}],
            "drive": {"slip_relative": 0.3},
        }
    )
    known = with_its_own(NAME, OnboardConfig.model_validate({"imu": {"gyro_scale_sigma": 0.0}}))
    robot = Emulator(SHIPPED[NAME].vehicle, world, known)
    robot.begin_guided()
    aligned(robot)
    states = set()
    for round_trip in range(8):
        drive(robot, 1000, 2.9 if round_trip % 2 else 1.0, 1.9 if round_trip % 4 > 1 else 1.0)
        states.add(robot.onboard.state)
    assert states <= {TraversalStatus.RUNNING, TraversalStatus.PAUSED}
    drive(robot, 1500, 2.0, 1.5)
    assert off(robot, 2.0, 1.5) < 0.03


def test_a_robot_without_a_pose_stands_in_time_says_why_and_goes_on_at_once_when_it_is_seen() -> None:
    robot = aligned(guided(margin_m=MARGIN_M))
    drive(robot, 300, 2.9, 1.9)
    robot.inject_fault(CameraOutage(kind="camera-outage", duration_s=8.0))
    for round_trip in range(3):
        drive(robot, 200, 1.0 if round_trip % 2 else 2.9, 1.0 if round_trip % 2 else 1.9)
    assert robot.onboard.must_stand
    assert robot.onboard.status.state == TraversalStatus.RUNNING
    assert "waiting for its pose: there has been no camera pose" in robot.onboard.status.reason
    assert abs(robot.world.state.speed_mps) < 1e-3
    row = np.zeros(9)
    claim_pose(robot.onboard._state.array, row)
    assert math.sqrt(np.linalg.eigvalsh(row.reshape(3, 3)[:2, :2])[-1]) <= math.sqrt(2.0) * MARGIN_M / 3.0
    drive(robot, 280, 1.0, 1.0)
    assert robot.onboard.status.reason == ""
    away_m = off(robot, 1.0, 1.0)
    drive(robot, 300, 1.0, 1.0)
    assert off(robot, 1.0, 1.0) < away_m - 0.1


def test_a_gap_between_two_poses_does_not_slow_a_robot_down() -> None:
    speeds = []
    for gap_s in (0.0, 0.4):
        robot = aligned(guided(margin_m=MARGIN_M))
        drive(robot, 150, 2.9, 1.9)
        if gap_s:
            robot.inject_fault(CameraOutage(kind="camera-outage", duration_s=gap_s))
        drive(robot, 45, 2.9, 1.9)
        speeds.append(robot.world.state.speed_mps)
    assert speeds[1] == pytest.approx(speeds[0], abs=0.01)
    assert speeds[0] > 0.3


@pytest.mark.parametrize("margin_m", [0.02, 0.03, 0.1])
def test_distance_of_two_robots_without_a_pose_holds_three_sigma(margin_m: float) -> None:
    limits = dead_reckoning(margin_m, SHIPPED[NAME].vehicle.drive, with_its_own(NAME, OnboardConfig()).drive)
    assert APART_SIGMAS * math.hypot(limits.sigma_m, limits.sigma_m) == pytest.approx(2.0 * margin_m)
    assert limits.growth_m == pytest.approx(1e-4)


def test_speed_from_which_a_robot_comes_to_rest_in_time() -> None:
    speed_mps = speed_to_rest_within(0.275, 0.5, 0.05)
    assert speed_mps == pytest.approx(0.5)
    assert speed_to_rest_within(0.0, 0.5, 0.05) == 0.0


OF_ROBOT = LIMITS._replace(yaw_acceleration_radps2=4.5)


def test_it_follows_plans_in_time_late_by_its_motors_alone() -> None:
    robot, rng, off_m = aligned(guided(plans=True)), np.random.default_rng(1), []
    robot.tick()  # it stood to align until now
    plan = np.zeros((plan_kernels.samples_of(OF_ROBOT), timed_motion.COLUMNS))
    plan[:, :3] = robot.onboard.estimate[:3]
    lag_s, planned = SHIPPED[NAME].vehicle.drive.motor_time_constant_s, np.zeros(timed_motion.COLUMNS)
    for number in range(60):
        speed, rate = plan_kernels.primitive(plan[0], int(rng.integers(plan_kernels.PRIMITIVES)), 0.0, OF_ROBOT)
        plan_kernels.roll_out(plan, speed, rate, OF_ROBOT, len(plan))
        now_s = robot.onboard.plan_state.stamp_s
        told = {"plan": plan.ravel().copy(), "plan_start_s": now_s, "plan_branch_s": now_s, "plan_base": number}
        assert robot.onboard.take_guidance(Guidance(number=number + 1, **told))
        for _ in range(40):
            robot.tick()
        timed_motion.motion_at(plan, 0.4 - lag_s, planned)
        off_m.append(off(robot, planned[0], planned[1]))
        plan_kernels.advance(plan[None], OF_ROBOT.update_steps)
    assert max(off_m) <= 0.012
    assert robot.onboard.plan_state.adopted == 60
    for _ in range(200):
        robot.tick()
    assert abs(robot.world.state.speed_mps) < 1e-3  # nobody has told it more: the plan has ended at rest
