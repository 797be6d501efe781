"""Moments, densities and Lloyd's rule: known answers, other ways to the same numbers, and a cost that never rises."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fleet.teams import corner_grid, square
from touchline.coordination.cells import voronoi
from touchline.coordination.density import DiscDensity, EvenDensity, RasterDensity
from touchline.coordination.free_area import FreeArea
from touchline.coordination.lloyd import deployment, relaxed_targets, settled, square_cost

UNIT = square(1.0)
MIDDLE = np.array([[0.5, 0.5]])
L_SHAPE = FreeArea.of([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)])
places = st.lists(st.tuples(st.floats(0.01, 2.99), st.floats(0.01, 2.99)), min_size=1, max_size=6, unique=True)


def apart(rows):
    return all(math.dist(p, q) > 1e-3 for k, p in enumerate(rows) for q in rows[:k])


def test_one_robot_amid_a_unit_square_costs_a_sixth():
    found = deployment(MIDDLE, UNIT)
    assert found.cost == pytest.approx(1.0 / 6.0, abs=1e-15)
    assert found.centroids == pytest.approx(MIDDLE, abs=1e-15)
    assert square_cost(1, 1.0) == pytest.approx(1.0 / 6.0)
    assert deployment(np.zeros((1, 2)), UNIT).cost == pytest.approx(2.0 / 3.0)


def test_a_right_triangles_centroid_and_second_moment():
    triangle = FreeArea.of([(0.0, 0.0), (3.0, 0.0), (0.0, 6.0)])
    found = deployment(np.zeros((1, 2)), triangle)
    assert found.centroids[0].tolist() == pytest.approx([1.0, 2.0])
    assert found.cost == pytest.approx((3.0**3 * 6.0 + 3.0 * 6.0**3) / 12.0)


def test_a_disc_within_a_square_has_the_moments_of_a_disc():
    parts = voronoi(np.array([[0.5, 0.4]]), UNIT)
    mass, first_x, first_y, second = DiscDensity(((0.5, 0.5, 0.3, 2.0),), 0.0).moments(parts, np.array([[0.5, 0.4]]))[0]
    whole = 2.0 * math.pi * 0.3**2
    assert (mass, first_x, first_y) == pytest.approx((whole, 0.0, 0.1 * whole), abs=1e-14)
    assert second == pytest.approx(2.0 * math.pi * 0.3**4 / 2.0 + whole * 0.1**2)


@settings(max_examples=40)
@given(places.filter(apart), st.floats(-0.5, 3.5), st.floats(-0.5, 3.5), st.floats(0.05, 3.0))
def test_discs_have_the_moments_of_polygons_with_many_corners(rows, x, y, radius):
    points = np.array(rows)
    found = DiscDensity(((x, y, radius, 1.0),), 0.0).moments(voronoi(points, square(3.0)), points)
    disc = shapely.Point(x, y).buffer(radius, quad_segs=512)
    area = shapely.box(0, 0, 3, 3)
    assert found[:, 0].sum() == pytest.approx(disc.intersection(area).area, abs=1e-4)
    centre = disc.intersection(area).centroid
    first = (found[:, 1:3] + found[:, :1] * points).sum(axis=0)
    if found[:, 0].sum() > 1e-3:
        assert first / found[:, 0].sum() == pytest.approx((centre.x, centre.y), abs=2e-3)


@settings(max_examples=40)
@given(places.filter(apart))
def test_a_raster_of_ones_is_the_same_as_an_even_density(rows):
    points = np.array(rows)
    parts = voronoi(points, square(3.0))
    raster = RasterDensity(np.ones((15, 15)), 0.2)
    assert raster.moments(parts, points) == pytest.approx(EvenDensity().moments(parts, points), abs=1e-9)


def test_a_raster_is_nothing_outside_itself_and_counts_where_it_is():
    points = np.array([[1.0, 1.0]])
    parts = voronoi(points, square(4.0))
    raster = RasterDensity(np.array([[0.0, 3.0], [0.0, 0.0]]), 1.0, (1.0, 1.0))
    assert raster.moments(parts, points)[0] == pytest.approx((3.0, 4.5, 1.5, 3.0 * (7.0 / 3.0 + 1.0 / 3.0)))
    nothing = deployment(points, square(4.0), RasterDensity(np.zeros((2, 2)), 1.0))
    assert nothing.centroids.tolist() == points.tolist()


@settings(max_examples=40)
@given(places.filter(apart))
def test_going_to_the_centroids_never_costs_more(rows):
    points = np.array(rows)
    for area in (square(3.0), FreeArea.of([(0, 0), (4, 0), (4, 3), (1, 5)])):
        before = deployment(points, area)
        after = deployment(before.centroids, area) if apart(before.centroids.tolist()) else before
        assert after.cost <= before.cost + 1e-12


def test_the_parts_of_an_area_that_is_not_convex_add_up():
    assert deployment(np.zeros((1, 2)), L_SHAPE).centroids == pytest.approx(np.array([[1.1, 1.1]]))
    assert EvenDensity(2.0).moments(voronoi(MIDDLE, L_SHAPE), MIDDLE)[0, 0] == pytest.approx(10.0)


def test_targets_go_beyond_the_centroid_but_not_for_a_centimetre():
    found = relaxed_targets(np.zeros((2, 2)), np.array([(1.0, 0.0), (0.0099, 0.0)]))
    assert found == pytest.approx(np.array([(1.7, 0.0), (0.0, 0.0)]))


def test_points_settle_where_their_centroids_are():
    area = square(5.0)
    points = settled(corner_grid(10)[:, :2].copy(), area)
    found = deployment(points, area)
    assert np.hypot(*(found.centroids - points).T).max() < 0.01
    assert found.cost / square_cost(10, 25.0) < 1.03
