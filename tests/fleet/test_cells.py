"""Cells of points and of stopping segments: known answers, degenerate cases, and the properties that make them safe."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from tests.fleet.all_at_once import buffered_cells, stopping_segments
from tests.fleet.teams import square
from touchline.coordination.cells import BufferedCell, CoincidentPoints, SegmentsMeet, voronoi
from touchline.coordination.free_area import FreeArea
from touchline.coordination.kernels.nearest import nearest_in, nearest_pair
from touchline.schemas.errors import SpecError

L_SHAPE = FreeArea.of([(0, 0), (6, 0), (6, 2), (2, 2), (2, 6), (0, 6)])
COURT = FreeArea.of([(0, 0), (6, 0), (6, 6), (0, 6)], [[(2.5, 2.5), (3.5, 2.5), (3.5, 3.5), (2.5, 3.5)]])
coordinates = st.floats(0.0, 6.0).map(lambda value: round(value, 9))
points = st.builds(complex, coordinates, coordinates)


def shape_of(corners):
    return shapely.Polygon(corners) if len(corners) > 2 else shapely.Polygon()


def line(segment):
    return shapely.LineString(np.asarray(segment).reshape(2, 2))


def radius_of_largest_disc_m(cell):
    """Radius of the largest disc that all half-planes of a cell hold, negative if they have no point in common."""
    rows = cell.half_planes[np.abs(cell.half_planes[:, :2]).sum(axis=1) > 0.0]
    constraints = np.column_stack((rows[:, :2], np.ones(len(rows))))
    found = linprog((0.0, 0.0, -1.0), constraints, rows[:, 2], bounds=(None, None))
    assert found.success, found.message
    return found.x[2]


def segments(*rows):
    return np.array(rows, dtype=np.float64)


@given(points, points, points, points)
def test_the_nearest_points_of_segments_are_as_far_apart_as_shapely_has_them(a, b, c, d):
    one, other = nearest_pair(a, b, c, d)
    first, second = (line([p.real, p.imag, q.real, q.imag]) for p, q in ((a, b), (c, d)))
    assert abs(one - other) == pytest.approx(first.distance(second), abs=1e-12)
    assert first.distance(shapely.Point(one.real, one.imag)) < 1e-12
    assert second.distance(shapely.Point(other.real, other.imag)) < 1e-12


def test_segments_without_length_or_side_by_side_have_nearest_points_too():
    assert nearest_pair(1j, 1j, 3 + 1j, 3 + 1j) == (1j, 3 + 1j)
    assert nearest_pair(1j, 1j, -1 + 0j, 2 + 0j) == (1j, 0j)
    one, other = nearest_pair(0j, 4 + 0j, 1 + 1j, 3 + 1j)
    assert other - one == 1j
    assert nearest_pair(0j, 2 + 2j, 2j, 2 + 0j) == (1 + 1j, 1 + 1j)
    assert nearest_pair(0j, 1 + 0j, 1 + 0j, 1 + 1j) == (1 + 0j, 1 + 0j)


def test_a_point_in_a_polygon_is_its_own_nearest():
    corners = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)])
    assert nearest_in(corners, 4, 1 + 0.5j) == 1 + 0.5j
    assert nearest_in(corners, 4, 3 + 0.5j) == 2 + 0.5j
    assert nearest_in(corners, 4, 3 + 4j) == 2 + 1j


@pytest.mark.parametrize("area", [square(6.0), L_SHAPE, COURT], ids=["square", "L", "court"])
@settings(max_examples=30)
@given(st.lists(points, min_size=1, max_size=8, unique=True))
def test_voronoi_cells_are_all_of_the_area_and_nearest_to_their_own(area, places):
    rows = np.array([(p.real, p.imag) for p in places])
    assume(len(rows) == 1 or min(abs(p - q) for p in places for q in places if p != q) > 1e-6)
    parts = voronoi(rows, area)
    cells = [  # on a grid: without, GEOS 3.14 loses some of parts whose corners all but coincide
        shapely.union_all([shape_of(some[:count]) for some, count in zip(*each, strict=True)], grid_size=1e-9)
        for each in zip(parts.corners, parts.counts, strict=True)
    ]
    assert sum(cell.area for cell in cells) == pytest.approx(area.area_m2, abs=1e-6)
    for own, cell in enumerate(cells):
        for x, y in shapely.get_coordinates(cell):
            apart = np.hypot(*(rows - (x, y)).T)
            assert apart[own] <= apart.min() + 1e-6


def test_two_robots_share_a_room_by_a_strip_as_wide_as_both():
    left, right = buffered_cells(segments((1, 2, 1, 2), (3, 2, 3, 2)), square(4.0), 0.2)
    assert shape_of(left.corners).symmetric_difference(shapely.box(0.2, 0.2, 1.8, 3.8)).area < 1e-12
    assert shape_of(right.corners).symmetric_difference(shapely.box(2.2, 0.2, 3.8, 3.8)).area < 1e-12
    driving, _ = buffered_cells(segments((1, 2, 1.5, 2), (3, 2, 3, 2)), square(4.0), 0.2)
    assert driving.corners[:, 0].max() == pytest.approx(2.05)


def test_who_is_too_near_already_comes_no_nearer():
    left, right = buffered_cells(segments((1, 2, 1, 2), (1.3, 2, 1.3, 2)), square(4.0), 0.2)
    assert left.corners[:, 0].max() == pytest.approx(1.0)
    assert right.corners[:, 0].min() == pytest.approx(1.3)
    (beside,) = buffered_cells(segments((0.1, 2, 0.1, 2)), square(4.0), 0.2)
    assert beside.corners[:, 0].min() == pytest.approx(0.1)
    (outside,) = buffered_cells(segments((-0.5, 2, -0.5, 2)), square(4.0), 0.2)
    assert outside.excess_m(np.array((-0.5, 2.0, -0.5, 2.0))) <= 0.0
    assert outside.nearest(np.array((2.0, 2.0)), np.zeros(2)).tolist() == [2.0, 2.0]


def test_robots_that_are_about_to_meet_are_named():
    with pytest.raises(SegmentsMeet, match="robot b is about to run into c"):
        buffered_cells(segments((0, 1, 0, 1), (1, 1, 2, 1), (1.5, 0.5, 1.5, 1.5)), square(4.0), 0.2, ["a", "b", "c"])
    with pytest.raises(SegmentsMeet, match="robot 0 is about to run into 1"):
        buffered_cells(segments((1, 1, 1, 1), (1, 1, 1, 1)), square(4.0))
    with pytest.raises(SegmentsMeet, match="robot 0 is about to run into a wall"):
        buffered_cells(segments((2.2, 3, 2.8, 3)), COURT)
    with pytest.raises(CoincidentPoints):
        voronoi(np.ones((2, 2)), square(4.0))


@pytest.mark.parametrize("area", [square(6.0), L_SHAPE, COURT], ids=["square", "L", "court"])
@settings(max_examples=30)
@given(st.lists(st.tuples(points, st.floats(0, math.tau), st.floats(0, 0.5)), min_size=1, max_size=8))
@example([(0.25 + 0.25j, 0.0, 0.0), (0.25 + 0.09517578j, 0.0, 0.0)])  # between a robot and a side: a cell without width
def test_cells_hold_their_segments_and_keep_their_distance(area, team):
    free = shapely.union_all([shape_of(piece[:size]) for piece, size in zip(area.pieces, area.sizes, strict=True)])
    kept: list[np.ndarray] = []
    for row in stopping_segments(np.array([(p.real, p.imag, heading, speed) for p, heading, speed in team]), 0.5):
        apart = [line(row).distance(line(other)) for other in kept] + [line(row).distance(free.boundary)]
        if free.contains(line(row)) and min(apart) > 1e-3:
            kept.append(row)
    assume(kept)
    rows = np.array(kept)
    lines = [line(row) for row in rows]
    cells = buffered_cells(rows, area, 0.2)
    assert max(cell.excess_m(row) for cell, row in zip(cells, rows, strict=True)) < 1e-12
    shapes = [shape_of(cell.corners) for cell in cells]
    for k, shape in enumerate(shapes):
        if shape.is_empty:
            assert radius_of_largest_disc_m(cells[k]) < 1e-9
            continue
        assert shape.distance(lines[k]) < 1e-9
        assert shape.distance(free.boundary) > min(0.2, lines[k].distance(free.boundary)) - 1e-9
        assert free.buffer(1e-9).contains(shape)
        for j, other in enumerate(shapes[:k]):
            if not other.is_empty:
                assert shape.distance(other) > min(0.4, lines[k].distance(lines[j])) - 1e-9


@pytest.mark.parametrize("area", [square(6.0), L_SHAPE, COURT], ids=["square", "L", "court"])
@pytest.mark.parametrize("robots", [1, 4, 12])
def test_the_half_planes_that_bind_say_all_that_all_do(area, robots):
    rng = np.random.default_rng(robots)
    free = shapely.union_all([shape_of(piece[:size]) for piece, size in zip(area.pieces, area.sizes, strict=True)])
    kept: list[np.ndarray] = []
    while len(kept) < robots:
        pose = (*rng.uniform(0.0, 6.0, 2), rng.uniform(0.0, math.tau), rng.uniform(0.0, 0.5))
        (row,) = stopping_segments(np.array([pose]), 0.5)
        if free.contains(line(row)) and all(line(row).distance(line(other)) > 1e-3 for other in kept):
            kept.append(row)
    for cell, row in zip(buffered_cells(np.array(kept), area, 0.2), kept, strict=True):
        binding = BufferedCell(cell.binding(row), cell.corners)
        assert len(binding.half_planes) <= np.count_nonzero(np.abs(cell.half_planes[:, :2]).sum(axis=1))
        assert {tuple(each) for each in binding.half_planes.tolist()} <= {
            tuple(each) for each in cell.half_planes.tolist()
        }
        near = row[:2] + rng.normal(0.0, 0.5, (300, 2))
        inside = rng.dirichlet(np.ones(len(cell.corners)), 100) @ cell.corners
        for point in np.vstack((near, inside, rng.uniform(-9.0, 15.0, (300, 2)))):
            ways = [each.excess_m(np.tile(point, 2)) for each in (cell, binding)]
            assert abs(ways[0]) < 1e-5 or (ways[0] > 0.0) == (ways[1] > 0.0)


def test_half_planes_that_another_makes_superfluous_do_not_bind():
    row = segments((1, 2, 1, 2), (2, 2, 2, 2), (3.9, 2, 3.9, 2))
    cell = buffered_cells(row, square(6.0), 0.2)[0]
    assert sorted(cell.binding(row[0]).tolist()) == pytest.approx(
        np.array(sorted([(1.0, 0.0, 1.3), (-1.0, 0.0, -0.2), (0.0, 1.0, 5.8), (0.0, -1.0, -0.2)]))
    )
    nothing_left = BufferedCell(cell.half_planes, np.zeros((0, 2)))
    assert len(nothing_left.binding(row[0])) == np.count_nonzero(np.abs(cell.half_planes[:, :2]).sum(axis=1)) == 6


def test_all_half_planes_bind_who_is_outside_the_area():
    """Clipped by the area's hull, the polygon says nothing of what others keep to out there."""
    rows = segments((1, -1, 1, -1), (1, -0.5, 1, -0.5))
    cell = buffered_cells(rows, square(4.0), 0.2)[1]
    binding = BufferedCell(cell.binding(rows[1]), cell.corners)
    assert binding.excess_m(rows[0]) == cell.excess_m(rows[0]) > 0.4


def test_a_cell_ends_at_a_corner_that_it_cannot_see_round():
    (cell,) = buffered_cells(segments((4, 1, 4, 1)), L_SHAPE, 0.2)
    assert cell.corners.max(axis=0).tolist() == pytest.approx([5.8, 1.8])
    (at_the_bend,) = buffered_cells(segments((1, 1, 1, 1)), L_SHAPE, 0.2)
    assert shape_of(at_the_bend.corners).area > 1.6**2


def test_a_cell_that_rounding_has_emptied_sends_nobody_anywhere():
    here = np.array((1.0, 2.0))
    assert BufferedCell(np.zeros((0, 3)), np.zeros((0, 2))).nearest(np.zeros(2), here) is here


@pytest.mark.parametrize(
    ("stands", "goal"),
    [((0.15, 3.0), (0.1, 5.0)), ((4.0, 1.95), (1.0, 1.9)), ((2.15, 4.0), (2.0, 2.1))],
    ids=["border", "wall", "wall of the other arm"],
)
def test_who_has_come_too_near_to_a_wall_is_led_off_it_and_held_where_it_is(stands, goal):
    free = shapely.union_all(
        [shape_of(piece[:size]) for piece, size in zip(L_SHAPE.pieces, L_SHAPE.sizes, strict=True)]
    )
    gap_m = free.boundary.distance(shapely.Point(stands))
    assert gap_m < 0.2
    (cell,) = buffered_cells(segments((*stands, *stands)), L_SHAPE, 0.2)
    assert cell.excess_m(np.array((*stands, *stands))) < 1e-12
    target = cell.nearest(np.array(goal), np.array(stands))
    assert free.boundary.distance(shapely.Point(target)) > 0.2 - 1e-9
    (roomy,) = buffered_cells(segments((1, 1, 1, 1)), L_SHAPE, 0.2)
    assert np.array_equal(roomy.roomy, roomy.corners)


def test_where_there_is_no_room_a_cell_is_taken_as_it_is():
    """A corridor of 0.3 m."""
    corridor = FreeArea.of([(0, 0), (4, 0), (4, 0.3), (0, 0.3)])
    (cell,) = buffered_cells(segments((1, 0.12, 1, 0.12)), corridor, 0.2)
    x, y = cell.nearest(np.array((3.0, 0.15)), np.zeros(2)).tolist()
    assert x == pytest.approx(3.0) and 0.1 < y < 0.2


@pytest.mark.parametrize(
    ("outline", "obstacles", "field"),
    [
        ([(0, 0), (1, 1), (1, 0), (0, 1)], [], "outline"),
        ([(0, 0), (1, 0)], [], "outline"),
        ([(0, 0), (1, 0), (math.nan, 1)], [], "outline"),
        ([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (2, 2), (2, 1), (1, 2)]], r"obstacles\[0\]"),
        ([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, -1), (2, -1), (2, 5), (1, 5)]], "obstacles leave"),
        ([(0, 0), (4, 0), (4, 4), (0, 4)], [[(-1, -1), (5, -1), (5, 5), (-1, 5)]], "obstacles leave"),
    ],
)
def test_what_is_no_area_is_refused(outline, obstacles, field):
    with pytest.raises(SpecError, match=field):
        FreeArea.of(outline, obstacles)
