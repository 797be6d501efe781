"""Several cameras overhead: edges, overlap, what hides robots, and robots that are taken for each other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.onboard.interface import CameraSample
from touchline.schemas.scenario import CameraNoise, Scenario
from touchline.schemas.team import TeamScenario
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker

TURTLEBOT = SHIPPED["turtlebot2"].vehicle
WEST: dict[str, Any] = {"x_m": 1.5, "y_m": 2.0, "view": [(0, 0), (3.3, 0), (3.3, 4), (0, 4)]}
EAST: dict[str, Any] = {"x_m": 4.5, "y_m": 2.0, "view": [(2.7, 0), (6, 0), (6, 4), (2.7, 4)], "off_x_m": 0.015}
WALL = {"outline": [(2, 2.4), (2.2, 2.4), (2.2, 2.6), (2, 2.6)], "height_m": 1.8}
BOX = {"outline": [(2, 2.4), (2.2, 2.4), (2.2, 2.6), (2, 2.6)], "height_m": 0.3}


def poses(x_m: float, y_m: float, ticks: int = 300, effects: Effects | None = None, **told: Any) -> list[CameraSample]:
    """Poses of a robot that stands and faces north."""
    camera = CameraNoise.model_validate({"cameras": [WEST, EAST], "latency_jitter_s": 0.0, **told})
    sensors = Sensors(TURTLEBOT, Scenario(noise="default" if "white_m" in told else "none", camera=camera))
    state = BodyState.sized(2)(east_m=x_m, north_m=y_m, heading_rad=1.0, up_z=1.0)
    return [pose for tick in range(1, ticks + 1) for pose in sensors.read(tick, state, effects).camera]


def test_a_robot_is_seen_by_the_nearest_camera_within_whose_view_it_is() -> None:
    assert {pose[1:4] for pose in poses(1.0, 1.0)} == {(1.0, 1.0, 1.0)}
    assert {pose.east_m for pose in poses(2.9, 1.0)} == {2.9}  # both see it
    assert [pose.east_m for pose in poses(3.1, 1.0)] == pytest.approx([3.115] * 43)  # off as the other is
    assert poses(3.1, 5.0) == []


def test_a_turned_camera_turns_poses_about_the_place_below_it() -> None:
    (pose,) = {pose[1:4] for pose in poses(2.5, 2.0, cameras=[WEST | {"off_rad": 0.01}])}
    assert pose == (pytest.approx(1.5 + math.cos(0.01)), pytest.approx(2.0 + math.sin(0.01)), pytest.approx(1.01))


def test_what_is_high_and_between_hides_a_robot_while_it_is_there() -> None:
    walks = WALL | {"outline": [(x - 2.0, y) for x, y in WALL["outline"]], "x_mps": 1.0}
    assert len(poses(2.5, 2.9)) == 43
    assert poses(2.5, 2.9, hiding=[WALL]) == []
    assert len(poses(1.9, 2.9, hiding=[WALL])) == 43  # beside its shadow
    assert len(poses(2.5, 2.9, hiding=[BOX])) == 43  # lower than the tag
    assert 24 < len(poses(2.5, 2.9, hiding=[walks])) < 43
    assert len(poses(2.5, 2.9, hiding=[WALL | {"start_s": 1.0, "duration_s": 1.0}])) == 28


def test_errors_grow_towards_the_edge() -> None:
    told = {"cameras": [WEST | {"edge_factor": 4.0}], "white_m": 0.01, "ticks": 6000}
    middle, corner = (np.std([pose.east_m for pose in poses(*at, **told)]) for at in ((1.5, 2.0), (0.01, 0.01)))
    assert middle == pytest.approx(0.01, rel=0.1)
    assert corner > 3.3 * middle


def test_a_robot_that_is_taken_for_another_has_its_pose() -> None:
    effects = Effects.sized(2)(camera_east_m=0.4, camera_north_m=-0.1, camera_rad=0.5)
    assert {pose[1:4] for pose in poses(1.0, 1.0, effects=effects)} == {(1.4, 0.9, 1.5)}


@pytest.mark.parametrize("avoid", ["cells", "plans"])
def test_robots_under_two_cameras_that_confuse_them_do_not_touch(avoid: str) -> None:
    def taken(east_m: float) -> list[dict[str, Any]]:
        times = {"kind": "camera-swapped", "duration_s": 0.6, "east_m": east_m}
        return [times | {"start_s": 3.0}, times | {"start_s": 7.0}]

    wall = [(2.8, 3.2), (3.2, 3.2), (3.2, 3.6), (2.8, 3.6)]
    run = TeamRun(
        TeamScenario.model_validate(
            {
                "robots": 6,
                "task": {"kind": "swap"},
                "avoid": avoid,
                "area": {"outline": [(0, 0), (6, 0), (6, 4), (0, 4)], "obstacles": [wall], "obstacle_height_m": 1.8},
                "world": {"seed": 4, "camera": {"cameras": [WEST, EAST]}},
                "faults": {"tb1": taken(0.6), "tb4": taken(-0.6)},
                "duration_s": 40.0,
            }
        )
    )
    assert run.robots["tb1"].emulator.scenario.camera.hiding[0].height_m == 1.8
    worst_m = 0.0
    drive = run._drive

    def watched(*arguments: Any) -> None:
        nonlocal worst_m
        drive(*arguments)
        for robot in run.robots.values():
            x_m, y_m = robot.emulator.world.pose[:2]
            estimate = robot.emulator.onboard.estimate
            worst_m = max(worst_m, math.hypot(estimate[0] - x_m, estimate[1] - y_m))

    run._drive = watched  # type: ignore[method-assign]
    run.run()
    figures = team_figures(run, 1.0)
    assert figures["contacts"] == 0
    assert worst_m < 0.05


@pytest.mark.parametrize(
    ("avoid", "radius_m", "strip_m", "crosses"),
    [
        ("plans", 0.2, 0.6, True),
        ("plans", 0.2, 1.2, False),
        ("plans", 0.25, 1.2, True),
        ("cells", 0.2, 0.8, True),
        ("cells", 0.2, 1.2, False),
    ],
)
def test_a_robot_crosses_a_strip_that_no_camera_sees_if_its_team_keeps_room_for_that(
    avoid: str, radius_m: float, strip_m: float, crosses: bool
) -> None:
    near_m, far_m = 3.0 - 0.5 * strip_m, 3.0 + 0.5 * strip_m
    views = [(0, 0), (near_m, 0), (near_m, 4), (0, 4)], [(far_m, 0), (6, 0), (6, 4), (far_m, 4)]
    cameras = [WEST | {"view": views[0]}, {"x_m": 4.5, "y_m": 2.0, "view": views[1]}]
    run = TeamRun(
        TeamScenario.model_validate(
            {
                "robots": 1,
                "places": {"tb1": {"x_m": 0.6, "y_m": 2.0, "heading_rad": 0.0}},
                "task": {"kind": "goals", "goals": {"tb1": [[5.4, 2.0]]}},
                "avoid": avoid,
                "radius_m": radius_m,
                "area": {"outline": [(0, 0), (6, 0), (6, 4), (0, 4)]},
                "world": {"camera": {"cameras": cameras}},
                "duration_s": 16.0,
            }
        )
    )
    run.run()
    assert (run.robots["tb1"].emulator.world.pose[0] > 5.2) == crosses
    stopped = team_figures(run, 1.0)["stopped"]
    assert crosses == (not stopped)
    assert all(reason.startswith("waiting for its pose") for reason in stopped.values())
