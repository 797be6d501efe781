"""Things that the plan knows, in hits and tracks, and the grid in which a missing one is found."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks._lidar_scene import Scene, Seeing, box, standing, still
from touchline.onboard.perception.fading_grid import CELL_M, CELLS, FREE, OCCUPIED, _move
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec

BENCH, OTHER = box(2.0, -0.5, 0.4, 1.0), box(2.0, 2.0, 0.4, 1.0)
LIDAR = LidarSpec(name="front")


def corners(walls: np.ndarray) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in walls[:, :2]]


def test_a_known_outline_explains_its_hits_which_come_last_and_makes_no_track() -> None:
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), standing(), still(walls=np.vstack((BENCH, OTHER))))
    seeing.perception.restart([corners(BENCH)])
    for _ in range(5):
        assert seeing.scan() == []
    found = seeing.perception.hits
    assert found is not None
    known, unknown = found.points_m[-found.standing :], found.points_m[: -found.standing]
    assert found.standing > 20
    assert known[:, 1].max() < 0.6
    assert unknown[:, 1].min() > 1.9
    (track,) = seeing.perception.tracks
    assert track.y_m > 1.5
    (outline,) = seeing.perception.seen_outlines
    assert (outline.place, outline.missing) == (0, False)


def test_a_return_inside_a_known_outline_is_known_and_one_beside_it_is_not() -> None:
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), standing(), still([(4.0, 0.0, 0.1), (4.0, 1.6, 0.1)]))
    seeing.perception.restart([[(3.0, -1.0), (5.0, -1.0), (5.0, 1.0), (3.0, 1.0)]])
    for _ in range(3):
        seeing.scan()
    found = seeing.perception.hits
    assert found is not None
    assert np.abs(found.points_m[-found.standing :, 1]).max() < 0.2
    assert found.points_m[: -found.standing, 1].min() > 1.4


def test_a_missing_known_thing_is_told_once_and_is_back_when_it_is_seen_again() -> None:
    walls = [BENCH]
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), standing(), lambda _t: Scene(walls=np.vstack(walls)))
    seeing.perception.restart([corners(BENCH), corners(OTHER)])
    told = [place for _ in range(60) for place in seeing.scan()]
    assert told == [1]
    assert [each.missing for each in seeing.perception.seen_outlines] == [False, True]
    walls.append(OTHER)
    assert [place for _ in range(20) for place in seeing.scan()] == []
    assert [each.missing for each in seeing.perception.seen_outlines] == [False, False]


def test_a_known_thing_that_is_hidden_is_not_missing() -> None:
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), standing(), still(walls=box(1.2, -1.0, 0.1, 2.0)))
    seeing.perception.restart([corners(BENCH)])
    assert [place for _ in range(60) for place in seeing.scan()] == []


def test_the_grid_has_what_was_seen_and_fades_and_moves_along() -> None:
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), lambda t: (1.5 * t, 0.0, 0.0), still(walls=box(4.0, -0.5, 0.4, 1.0)))
    seeing.perception.restart([corners(box(4.0, -0.5, 0.4, 1.0))])
    for _ in range(10):
        seeing.scan()
    grid = seeing.perception.grid

    def odds(x: float, y: float) -> float:
        i, j = (math.floor(v / CELL_M) - c for v, c in zip((x, y), grid.corner, strict=True))
        value: float = grid.log_odds[i, j]
        return value

    assert max(odds(4.0, y) for y in (-0.2, 0.0, 0.2)) > 3.0 * OCCUPIED
    assert odds(3.0, 0.0) < 2.0 * FREE
    assert odds(4.25, 0.05) == 0.0  # inside
    assert grid.log_odds.shape == (CELLS, CELLS)
    before = odds(4.0, 0.0)
    seeing._scene_at = still()
    seeing.scans += 300  # 30 s later the robot is 45 m on
    seeing.scan()
    assert not (grid.log_odds > 0.0).any()
    assert before > 0.0


def test_what_the_grid_knew_halves_in_30_s() -> None:
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), standing(), still(walls=box(2.0, -0.5, 0.4, 1.0)))
    seeing.perception.restart([corners(box(2.0, -0.5, 0.4, 1.0))])
    for _ in range(10):
        seeing.scan()
    before = seeing.perception.grid.log_odds.max()
    seeing.scans += 300
    sample = seeing.sample()
    seeing.perception.take(sample._replace(values=(math.nan,) * 720), seeing.estimator)
    assert abs(seeing.perception.grid.log_odds.max() / before - 0.5) < 0.02


def test_the_grid_is_kept_only_near_outlines() -> None:
    wall = box(4.0, 2.0, 0.4, 1.0)
    seeing = Seeing(Vehicle(sensors=(LIDAR,)), lambda t: (3.0 * t, 0.0, 0.0), still(walls=wall))
    seeing.perception.restart([corners(wall)])
    grid = seeing.perception.grid
    for _ in range(10):
        seeing.scan()
    assert (grid.log_odds > 0.0).any()
    for _ in range(40):
        seeing.scan()
    assert not grid.log_odds.any()
    seeing.perception.restart()
    seeing.scans = 0
    seeing.scan()
    assert not seeing.perception.grid.log_odds.any()


@given(st.lists(st.tuples(st.integers(-200, 200), st.integers(-200, 200)), min_size=1, max_size=5))
@settings(deadline=None)
def test_cells_that_come_in_are_unknown(moves: list[tuple[int, int]]) -> None:
    corner, cells, expected = np.zeros(2, np.int64), np.ones((CELLS, CELLS)), np.ones((CELLS, CELLS))
    x = y = 0
    for dx, dy in moves:
        x, y = x + dx, y + dy
        i, j = np.arange(x, x + CELLS), np.arange(y, y + CELLS)
        came_x, came_y = (i < x - dx) | (i >= x - dx + CELLS), (j < y - dy) | (j >= y - dy + CELLS)
        expected[np.ix_(i[came_x] % CELLS, j % CELLS)] = 0.0
        expected[np.ix_(i % CELLS, j[came_y] % CELLS)] = 0.0
        _move(corner, x, y, cells)
        assert corner.tolist() == [x, y]
        assert np.array_equal(cells, expected)
