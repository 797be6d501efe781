"""Angles, arcs and polygons in kernels: known answers, and the same as libraries and `schemas.curves` have it."""

import cmath
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.planner.strategies import floats
from touchline.core.angles import nearest_turn, wrapped, wrapped_all
from touchline.core.arcs import abreast, arc, beside, unit
from touchline.core.near_points import near_pairs
from touchline.core.polygons import apart_squared, off_squared, within
from touchline.core.random import whole
from touchline.schemas.curves import Curve

points = st.builds(complex, floats(-5, 5), floats(-5, 5))


@given(floats(-40, 40), floats(-10, 10))
def test_an_angle_is_the_same_but_for_whole_turns(angle: float, middle: float) -> None:
    near = nearest_turn(angle, middle)
    assert middle - math.pi - 1e-12 <= near <= middle + math.pi + 1e-12
    for found in (near, wrapped(angle), float(wrapped_all(np.array([angle]))[0])):
        assert abs(math.remainder(found - angle, math.tau)) < 1e-12
    assert -math.pi < wrapped(angle) <= math.pi


def test_half_a_turn_is_kept() -> None:
    assert wrapped(math.pi) == math.pi
    assert wrapped(-math.pi) == math.pi


@given(floats(-7, 7), floats(-2, 2), floats(0, 6))
def test_an_arc_leads_where_its_curve_does(heading: float, curvature: float, length: float) -> None:
    move, turn = arc(heading, curvature, length)
    x, y, end, _ = (float(v) for v in Curve(0.0, 0.0, heading, curvature, length).at(length))
    assert abs(move - complex(x, y)) < 1e-12
    assert turn == pytest.approx(end - heading, abs=1e-12)
    assert abs(unit(heading) - cmath.rect(1.0, heading)) < 1e-15


@given(
    floats(-7, 7), st.just(0.0) | floats(-0.5, -0.05) | floats(0.05, 0.5), floats(0.1, 4.0), floats(0, 1), floats(-1, 1)
)
def test_a_point_beside_an_arc_is_found_where_it_was_put(
    heading: float, curvature: float, length: float, share: float, aside: float
) -> None:
    row = np.array([3.0, -2.0, heading, curvature, length])
    x, y, at, _ = (float(v) for v in Curve(*row.tolist()).at(share * length))
    point = complex(x, y) + 1j * cmath.rect(aside, at)
    assert beside(point, row, unit(heading)) == pytest.approx(aside, abs=1e-11)
    assert abreast(point, row, unit(heading)) == pytest.approx(share * length, abs=1e-10)


@given(points, points, points, points)
def test_distances_of_segments_are_shapelys(a: complex, b: complex, c: complex, d: complex) -> None:
    first, second = (shapely.LineString([(p.real, p.imag), (q.real, q.imag)]) for p, q in ((a, b), (c, d)))
    assert math.sqrt(apart_squared(a, b, c, d)) == pytest.approx(first.distance(second), abs=1e-9)
    assert math.sqrt(off_squared(a, c, d)) == pytest.approx(second.distance(shapely.Point(a.real, a.imag)), abs=1e-9)


@given(points, st.lists(floats(0.5, 4.0), min_size=3, max_size=9))
def test_inside_an_outline_is_shapelys(point: complex, radii: list[float]) -> None:
    angles = np.arange(len(radii)) * math.tau / len(radii)
    corners = np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
    outline = shapely.Polygon(corners)
    assume(outline.exterior.distance(shapely.Point(point.real, point.imag)) > 1e-9)
    edges = np.hstack((corners, np.roll(corners, -1, axis=0)))
    assert within(point, edges) == outline.contains(shapely.Point(point.real, point.imag))


def test_whole_numbers_are_splitmix64s() -> None:
    """The reference outputs for the seed 1234567, as the generator's author and many ports have them."""
    known = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821]
    assert [whole(1234567, k, 1 << 53) for k in range(5)] == [number >> 11 for number in known]
    assert [whole(7, k, 0) for k in range(3)] == [0, 0, 0]
    assert {whole(7, k, 5) for k in range(100)} == {0, 1, 2, 3, 4}


POINTS = st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), max_size=12)


@given(POINTS, POINTS)
def test_pairs_are_those_of_a_full_search(first, second):
    a, b = (np.array(points, dtype=np.float64).reshape(-1, 2) for points in (first, second))
    apart = np.hypot(*(a[:, None] - b).transpose(2, 0, 1))
    assert near_pairs(a, b, 2.0).tolist() == np.argwhere(apart <= 2.0).tolist()
