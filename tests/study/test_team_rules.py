"""Robots that drive by a network study's rules: on paths of their own, into each other."""

import math

import numpy as np
import pytest

from touchline.jobs.team.path_guide import BRAKING_M, RADIUS_M, Departure, StudyDriver
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError, SpecError
from touchline.schemas.messages import LeavingTrajectory
from touchline.schemas.team import GoalsTask, TeamScenario
from touchline.schemas.vehicles.shipped import CLAY_ROLLER, TURTLEBOT2, TURTLEBOT3_WAFFLE_PI
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.poses.law4 import FAST_MPS, SLOW_MPS

pytestmark = [pytest.mark.timeout(400), pytest.mark.xdist_group("network study")]


def driven(team: TeamScenario) -> TeamRun:
    run = TeamRun(team)
    run.run()
    return run


def test_from_one_start_they_touch_where_cells_keep_them_apart() -> None:
    team = TeamScenario(robots=10, duration_s=16.0)
    by_path, by_cells = (driven(team.model_copy(update={"avoid": avoid})) for avoid in ("none", "cells"))
    assert by_path.starts == by_cells.starts
    contacts = by_path.contacts
    assert len(contacts.pairs) + len(contacts.at_walls) >= len(by_path.trace.touched)
    assert len(contacts.pairs) > 2 and contacts.closest_m < 2.0 * by_path.body_radius_m
    assert not by_cells.contacts.pairs and not by_cells.trace.touched
    # Who touches drives on, and is no failure: it is what the study does.
    assert team_figures(by_path, 1.0)["success"] and not team_figures(by_path, 1.0)["stopped"]
    assert min(by_path.trace.driven_m) > 0.5
    assert by_path.trace.cost[0] == by_cells.trace.cost[0] > by_cells.trace.cost[-1]


@pytest.mark.parametrize("path", ["bearing", "free"])
def test_a_robot_alone_comes_to_its_goals_in_turn(path: str) -> None:
    goals = ((1.4, 0.6), (0.5, 0.5))
    task = GoalsTask(kind="goals", goals={"tb1": goals})
    run = driven(TeamScenario.model_validate({"robots": 1, "task": task, "avoid": "none", "path": path}))
    places = np.array([*run.trace.places, run.places()])[:, 0]
    assert [np.hypot(*(places - goal).T).min() < 0.1 for goal in goals] == [True, True]
    assert run.trace.ended_s < 60.0 and run.robots["tb1"].stopped == ""


@pytest.mark.parametrize("free", [False, True])
def test_paths_turn_by_the_studys_radius_and_end_at_rest_near_the_goal(free: bool) -> None:
    driver = StudyDriver(TURTLEBOT2, free=free)
    for x, y, heading in np.random.default_rng(3).uniform(-3.0, 3.0, (20, 3)).tolist():
        trajectory = driver.trajectory(Departure(PathPose(0.2, -0.1, heading)), (x, y))
        curves = [Curve.from_message(each.curve) for each in trajectory.path.segments]
        assert max(abs(each.curvature_1pm) for each in curves) <= 1.0 / RADIUS_M + 1e-6
        assert abs(curves[0].curvature_1pm) in (0.0, pytest.approx(1.0 / RADIUS_M))
        end_x, end_y, _, _ = curves[-1].at(curves[-1].length_m)
        assert math.hypot(end_x - x, end_y - y) < BRAKING_M
        entries = [each.velocity.value for each in trajectory.velocity_profile.parameters]
        assert entries[0] == entries[-1] == 0.0 and max(entries) <= FAST_MPS
        assert trajectory.velocity_profile.parameters[-1].arc_length == pytest.approx(
            sum(each.length_m for each in curves), abs=1e-9
        )
        if curves[0].curvature_1pm:
            assert entries[1] == SLOW_MPS  # at once: the law steps


def test_the_next_path_leaves_the_last_one_on_the_way_as_fast_as_that_is_driven() -> None:
    driver = StudyDriver(TURTLEBOT2, free=False)
    first = driver.trajectory(Departure(PathPose(0.0, 0.0, 0.0)), (2.0, 0.5))
    length_m = first.velocity_profile.parameters[-1].arc_length
    leaving = LeavingTrajectory(trajectory=first, arc_length_m=length_m - 0.2, keep_s=0.6)
    departure = Departure.under_way(leaving)
    assert 0.0 < departure.speed_mps <= FAST_MPS and departure.kept is not None
    assert not departure.is_off((departure.pose.x_m + 0.06, departure.pose.y_m - 0.07))
    goal = (1.0, 2.0)
    assert departure.is_off(goal)
    second = driver.trajectory(departure, goal)
    kept_m = departure.kept.sent[-1].end_m
    entries = [(each.arc_length, each.velocity.value) for each in second.velocity_profile.parameters]
    assert min(speed for at_m, speed in entries if at_m < kept_m + 0.5) > 0.0
    assert (kept_m, pytest.approx(departure.speed_mps)) in [(pytest.approx(at_m), speed) for at_m, speed in entries]
    last = Curve.from_message(second.path.segments[-1].curve)
    assert math.hypot(last.at(last.length_m)[0] - goal[0], last.at(last.length_m)[1] - goal[1]) < BRAKING_M


def test_a_robot_that_cannot_drive_like_that_is_refused() -> None:
    with pytest.raises(SpecError, match=r"drive.transit_speed_mps is 0.26 m/s"):
        StudyDriver(TURTLEBOT3_WAFFLE_PI, free=False)
    with pytest.raises(PlanningError, match="kappa_max_1pm"):
        StudyDriver(CLAY_ROLLER, free=False)
