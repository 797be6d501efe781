"""Areas as strokes: covered, and not beyond the edge."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon, union_all
from shapely.geometry.base import BaseGeometry

from touchline.drawings.hatch import hatch

WIDTH_M = 0.12


def painted(strokes: list) -> BaseGeometry:
    bands = [LineString(stroke).buffer(WIDTH_M / 2, cap_style="flat") for stroke in strokes]
    return union_all(bands, grid_size=1e-9)  # without a grid GEOS loses bands whose edges coincide but for rounding


@given(st.floats(0.13, 6.0), st.floats(0.13, 6.0), st.floats(-2.0, 2.0))
@example(1.0, 3.0, 2.0)
@settings(max_examples=12, deadline=None)
def test_a_rectangle_along_the_strokes_is_filled_exactly(width: float, height: float, angle: float) -> None:
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    ring = corners @ turn.T
    area = painted(hatch([ring], WIDTH_M, angle))
    assert area.symmetric_difference(Polygon(ring)).area < 1e-4 * (width + height)


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=3, max_size=8), st.floats(0.0, 3.0))
@example([(0.0, 0.0), (0.0, -1.0), (6.0987050903478454e-31, 0.0)], 1.0)
@settings(max_examples=12, deadline=None)
def test_nothing_is_painted_beyond_the_edge(points: list[tuple[float, float]], angle: float) -> None:
    hull = LineString(points).convex_hull
    if hull.geom_type != "Polygon":
        return
    ring = np.array(hull.exterior.coords)
    strokes = hatch([ring], WIDTH_M, angle)
    if strokes:
        assert painted(strokes).difference(hull).area < 1e-4


def test_a_hole_stays_empty_and_strokes_go_there_and_back() -> None:
    outer = np.array([(0, 0), (3, 0), (3, 3), (0, 3)])
    hole = np.array([(1, 1), (2, 1), (2, 2), (1, 2)])
    strokes = hatch([outer, hole], WIDTH_M)
    area = painted(strokes)
    assert area.intersection(Polygon(hole)).area < 1e-3
    assert area.area == pytest.approx(8.0, abs=0.15)
    first = [end[0] - start[0] for start, end in strokes]
    assert any(v > 0 for v in first) and any(v < 0 for v in first)


def test_what_is_narrower_than_a_stroke_is_not_painted() -> None:
    assert hatch([np.array([(0, 0), (5, 0), (5, 0.1), (0, 0.1)])], WIDTH_M) == []
