"""Tracks: people who walk, things that stand, their outlines; and the assignment behind them."""

import math

import numpy as np
import pytest
import shapely
from scipy.optimize import linear_sum_assignment

from benchmarks._lidar_scene import Scene, Seeing, box, legs, standing, still
from benchmarks.perception import LIDARS, follow_people
from touchline.onboard.perception.least_cost import assign
from touchline.onboard.perception.tracks import PERSON, POST, THING, WALL
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec

VEHICLE = Vehicle(sensors=(LidarSpec(name="front"),))


@pytest.mark.parametrize("name", LIDARS)
def test_walking_people_are_followed_within_their_sigmas(name: str) -> None:
    followed = follow_people(LIDARS[name], people=2, seconds=8, seed=100)
    assert followed.inside.mean() >= 0.989
    assert np.percentile(followed.off_m, 95.0) <= 0.2
    assert math.sqrt((followed.speed_off_mps**2).mean()) <= 0.5
    assert followed.moving.mean() > 0.8
    assert followed.lost == 0


@pytest.mark.parametrize("seed", range(20))
def test_an_assignment_costs_as_little_as_scipys(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, columns = sorted(rng.integers(1, 12, 2).tolist())
    cost = rng.uniform(0.0, 14.0, (rows, columns)).round(rng.integers(0, 3))
    row_of, way = np.zeros(columns + 1, np.int64), np.zeros(columns + 1, np.int64)
    assign(cost, rows, columns, row_of, np.zeros((4, columns + 1)), way)
    ours = [(row - 1, column) for column, row in enumerate(row_of[1:].tolist()) if row > 0]
    assert sorted(row for row, _ in ours) == list(range(rows))
    assert sum(cost[pair] for pair in ours) == pytest.approx(cost[linear_sum_assignment(cost)].sum())


def test_things_have_kinds_and_do_not_move_while_the_robot_drives_past() -> None:
    scene = still([(3.0, 2.0, 0.06)], np.vstack((box(-4.0, -3.0, 12.0, 0.1), box(4.0, 2.5, 1.0, 0.8))))
    seeing = Seeing(VEHICLE, lambda t: (1.2 * t, 0.0, 0.2 * math.sin(t)), scene)
    seeing.pose_sigma = (0.01, 0.002)
    for _ in range(25):
        seeing.scan()
        assert not any(each.moving for each in seeing.perception.tracks)
    assert {each.kind for each in seeing.perception.tracks} == {POST, THING, WALL}


def test_a_person_who_stands_is_a_person_and_one_who_walks_moves() -> None:
    seeing = Seeing(VEHICLE, standing(), lambda _t: Scene(legs(3.0, 0.0, 1.5, 0.5)))
    for _ in range(10):
        seeing.scan()
    (track,) = seeing.perception.tracks
    assert (track.kind, track.moving) == (PERSON, False)


def test_an_outline_holds_what_was_seen_with_its_margin_and_little_more() -> None:
    bench = shapely.box(2.0, -0.6, 2.5, 0.6)
    seeing = Seeing(VEHICLE, lambda t: (0.8 * t, -2.0, 0.0), still(walls=box(2.0, -0.6, 0.5, 1.2)))
    for _ in range(40):
        seeing.scan()
    (track,) = seeing.perception.tracks
    outline = shapely.Polygon(track.outline_m)
    assert outline.is_valid
    assert bench.buffer(0.15).contains(outline)
    seen_side = shapely.LineString([(2.0, -0.58), (2.5, -0.58), (2.5, 0.5)])
    assert outline.contains(seen_side)


def test_two_walls_of_a_corner_are_two_things_between_which_the_robot_is_free() -> None:
    corner = np.vstack((box(3.0, -3.0, 0.1, 6.0), box(-3.0, 3.0, 6.0, 0.1)))
    seeing = Seeing(VEHICLE, standing(), still(walls=corner))
    for _ in range(5):
        seeing.scan()
    assert all(
        not shapely.Polygon(each.outline_m).contains(shapely.Point(1.5, 1.5)) for each in seeing.perception.tracks
    )
    assert [each.kind for each in seeing.perception.tracks] == [WALL, WALL]


def test_a_track_ends_a_second_after_its_thing_has_gone() -> None:
    seeing = Seeing(VEHICLE, standing(), still([(2.0, 0.0, 0.1)]))
    for _ in range(5):
        seeing.scan()
    number = seeing.perception.tracks[0].number
    seeing._scene_at = still()
    lasted = 0
    while any(each.number == number for each in seeing.perception.tracks):
        seeing.scan()
        lasted += 1
    assert 9 <= lasted <= 12


def test_more_things_than_there_are_tracks_do_no_harm() -> None:
    angles = np.linspace(-3.1, 3.1, 170)
    posts = np.column_stack((9.0 * np.cos(angles), 9.0 * np.sin(angles), np.full(170, 0.06)))
    seeing = Seeing(VEHICLE, standing(), lambda _t: Scene(posts))
    for _ in range(4):
        seeing.scan()
    assert 50 < len(seeing.perception.tracks) <= 128
