"""The camera overhead: when it sees what, its faults, its topic, and robots that drive by it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.positioning import settings
from tests.with_full import with_full
from touchline.onboard.interface import CameraSample
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.faults import CameraOutage, Fault, MessagesLost
from touchline.schemas.messages import PlanOptions, PoseGoal, PoseWithCovarianceStamped, TraversalStatus
from touchline.schemas.scenario import CameraNoise, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker

TURTLEBOT = SHIPPED["turtlebot2"].vehicle
SMALL = ("turtlebot3-waffle-pi", "turtlebot2")
GOAL = PoseGoal(x_m=2.5, y_m=1.0, heading_rad=0.8)


def seen(scenario: Scenario, ticks: int, effects: Effects | None = None) -> list[tuple[int, CameraSample]]:
    """(tick of arrival, pose) of a robot that stands at (1, 2) and faces just short of west."""
    sensors, state = (
        Sensors(TURTLEBOT, scenario),
        BodyState.sized(2)(east_m=1.0, north_m=2.0, heading_rad=3.14, up_z=1.0),
    )
    frames = (sensors.read(tick, state, effects) for tick in range(1, ticks + 1))
    return [(frame.tick, pose) for frame in frames for pose in frame.camera]


def emulator(name: str = "turtlebot2", seed: int = 1, *faults: Fault, goal: PoseGoal = GOAL) -> Emulator:
    vehicle, scenario, config = settings(name, seed)
    made = Emulator(vehicle, scenario.model_copy(update={"faults": faults}), config)
    made.load(plan_to_goal(goal, vehicle, PlanOptions(start=[0.0, 0.0, 0.0])).trajectory)
    made.start()
    return made


def test_pictures_come_evenly_late_and_now_and_then_not_at_all() -> None:
    poses = seen(Scenario(), 20_000)
    taken = np.array([round(pose.stamp_s * 100) for _, pose in poses])
    assert set(taken * 15 % 100) <= set(range(15)), "fifteen a second, at whole ticks"
    assert len(poses) == pytest.approx(0.98 * 3000, abs=30)
    late = np.array([tick for tick, _ in poses]) - taken
    assert set(late) == {8, 9, 10}
    assert np.bincount(late)[8:] == pytest.approx([len(poses) / 3] * 3, rel=0.1)


def test_errors_are_white_and_of_the_scenario() -> None:
    poses = [pose for _, pose in seen(Scenario(camera=CameraNoise(white_m=0.02, white_rad=0.03)), 20_000)]
    turned = [math.remainder(pose.heading_rad - 3.14, math.tau) for pose in poses]
    errors = np.array([(pose.east_m - 1.0, pose.north_m - 2.0, turn) for pose, turn in zip(poses, turned, strict=True)])
    assert errors.std(axis=0) == pytest.approx([0.02, 0.02, 0.03], rel=0.06)
    assert np.abs(errors.mean(axis=0)).max() < 0.002
    assert np.abs(np.corrcoef(errors[:-1, 0], errors[1:, 0])[0, 1]) < 0.06
    assert all(abs(pose.heading_rad) <= math.pi for pose in poses)
    assert all(pose[4:] == pytest.approx((0.02, 0.03)) for pose in poses)


def test_without_noise_every_picture_has_the_true_pose() -> None:
    poses = seen(Scenario(noise="none"), 200)
    assert len(poses) == 28
    assert all(pose[1:4] == (1.0, 2.0, pytest.approx(3.14)) for _, pose in poses)


def test_an_outage_takes_poses_away_and_changes_no_other() -> None:
    assert seen(Scenario(), 1000, Effects.sized(2)(camera_out=True)) == []
    made, plain = emulator("turtlebot2", 1, CameraOutage(kind="camera-outage", start_s=2.0, duration_s=1.0)), emulator()
    for _ in range(200):
        made.tick()
        plain.tick()
        assert made.frame == plain.frame


def test_a_robot_has_one_of_both_and_tells_of_that() -> None:
    said = []
    for vehicle in (TURTLEBOT, Vehicle(), TURTLEBOT.model_copy(update={"positioning": "odometry"})):
        made = Emulator(vehicle, Scenario())
        telemetry = Telemetry(made)
        told = []
        for _ in range(100):
            made.tick()
            told += telemetry.after_tick()
        said.append({topic.name for topic, _ in told})
        poses = [decode(PoseWithCovarianceStamped, payload) for topic, payload in told if topic is topics.CAMERA_POSE]
        for message in poses:
            assert message.header.frame_id == "map"
            assert message.pose.covariance[[0, 7, 35]] == pytest.approx([1e-4, 1e-4, 0.01745**2])
            assert np.count_nonzero(message.pose.covariance) == 3
    camera, gnss = {topics.CAMERA_POSE.name}, {topics.GNSS_FIX.name, topics.GNSS_STATUS.name}
    assert [names & (camera | gnss) for names in said] == [camera, gnss, set()]


@pytest.mark.parametrize(
    ("name", "seed"),
    with_full(*((name, 1) for name in SMALL), full=((name, seed) for name in SMALL for seed in (2, 3))),
)
def test_both_small_robots_arrive_by_the_camera(name: str, seed: int) -> None:
    goal = PoseGoal(x_m=3.0, y_m=2.0, heading_rad=1.2)
    made = emulator(name, seed, goal=goal)
    FastRunner(made).run(6000)
    assert (made.onboard.state, made.onboard.status.reason) == (TraversalStatus.DONE, "")
    east_m, north_m, heading_rad = made.world.pose
    assert math.hypot(east_m - 3.0, north_m - 2.0) < 0.015
    assert abs(math.remainder(heading_rad - 1.2, math.tau)) < math.radians(1.5)


def test_the_fast_runner_makes_the_same_bits() -> None:
    lost = MessagesLost(kind="messages-lost", sensor="camera", share=0.5, start_s=2.0, duration_s=2.0)
    quick, slow = emulator("turtlebot2", 5, lost), emulator("turtlebot2", 5, lost)
    hashes = []
    for made in (quick, slow):
        telemetry, runner = Telemetry(made), FastRunner(made)
        while made.active:
            if made is quick:
                count = runner.step(telemetry.until_due(10), telemetry.rows)
            else:
                made.tick()
                count = 1
            telemetry.after(count)
        assert telemetry.final is not None
        hashes.append(telemetry.final.traversal.session_hash)
    assert hashes[0] == hashes[1]
    assert quick.world.pose == slow.world.pose


def test_it_drives_through_an_outage_and_says_what_it_misses() -> None:
    made = emulator("turtlebot2", 1, CameraOutage(kind="camera-outage", start_s=2.0, duration_s=5.0))
    for _ in range(400):
        made.tick()
    assert made.onboard.state == TraversalStatus.RUNNING
    made.pause()
    with pytest.raises(CommandRefused, match=r"there has been no camera pose for more than 0\.5 s"):
        made.resume()
    for _ in range(350):
        made.tick()
    made.resume()
    FastRunner(made).run(3000)
    assert made.onboard.state == TraversalStatus.DONE
    assert math.dist(made.world.pose[:2], (2.5, 1.0)) < 0.02


def test_a_camera_that_is_too_slow_for_its_data_sheet_is_refused() -> None:
    with pytest.raises(SpecError, match="camera"):
        Emulator(TURTLEBOT, Scenario(camera=CameraNoise(rate_hz=1)))


def test_what_is_usual_is_not_written() -> None:
    assert "camera" not in Scenario().model_dump()
    assert "positioning" not in Vehicle().model_dump()
    assert "camera-outage" in Scenario(faults=[CameraOutage(kind="camera-outage")]).model_dump_json()
    other = Scenario(camera=CameraNoise(rate_hz=30))
    assert Scenario.model_validate(other.model_dump()) == other
    assert Vehicle.model_validate(TURTLEBOT.model_dump(mode="json")) == TURTLEBOT
    assert TURTLEBOT.model_dump()["positioning"] == "overhead-camera"
