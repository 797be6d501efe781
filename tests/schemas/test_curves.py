"""Line and arc maths against geometry done by hand, and its own inverses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.schemas.curves import Curve, PathTable, wrap_angle
from touchline.schemas.messages import Arc, CurveMessage, CurveType, Line, Point

coordinate = st.floats(-200, 200)
angle = st.floats(-math.pi, math.pi)
curves = st.builds(
    Curve,
    coordinate,
    coordinate,
    angle,
    st.one_of(st.just(0.0), st.floats(0.01, 2.0), st.floats(-2.0, -0.01)),
    st.floats(0.05, 3.0),
)


def test_quarter_circle_to_the_left():
    arc = Curve.from_arc((1.0, 0.0), (0.0, 0.0), math.pi / 2)
    x, y, heading, curvature = arc.at(arc.length_m)
    assert (x, y) == pytest.approx((0.0, 1.0), abs=1e-15)
    assert heading == pytest.approx(math.pi)
    assert curvature == 1.0
    assert arc.length_m == pytest.approx(math.pi / 2)


def test_clockwise_arc_turns_right():
    arc = Curve.from_arc((0.0, 2.0), (0.0, 0.0), -math.pi)
    assert arc.curvature_1pm == -0.5
    assert arc.heading_rad == pytest.approx(0.0)
    assert arc.end == pytest.approx((0.0, -2.0, -math.pi))


def test_line_is_sampled_evenly():
    x, y, heading, curvature = Curve.from_line((1.0, 2.0), (4.0, 6.0)).at(np.array([0.0, 2.5, 5.0]))
    np.testing.assert_allclose(x, [1.0, 2.5, 4.0])
    np.testing.assert_allclose(y, [2.0, 4.0, 6.0])
    np.testing.assert_allclose(heading, math.atan2(4, 3))
    np.testing.assert_array_equal(curvature, 0.0)


def test_offset_beyond_the_centre_is_refused():
    with pytest.raises(ValueError, match=r"radius 0\.300 m"):
        Curve.from_arc((0.3, 0.0), (0.0, 0.0), 1.0).offset(0.41124)


def test_an_arc_needs_a_radius():
    with pytest.raises(ValueError, match="no radius"):
        Curve.from_arc((1.0, 1.0), (1.0, 1.0), 1.0)


@given(curves, st.floats(-0.3, 0.3))
def test_offset_points_lie_on_the_normal(curve: Curve, left_m: float):
    parallel = curve.offset(left_m)
    fraction = np.linspace(0, 1, 5)
    x, y, heading, _ = curve.at(fraction * curve.length_m)
    px, py, pheading, _ = parallel.at(fraction * parallel.length_m)
    np.testing.assert_allclose(px, x - left_m * np.sin(heading), atol=1e-11)
    np.testing.assert_allclose(py, y + left_m * np.cos(heading), atol=1e-11)
    np.testing.assert_allclose(pheading, heading, atol=1e-12)


@given(curves)
def test_reversed_twice_is_the_same(curve: Curve):
    x, y, heading = curve.end
    back = curve.reversed()
    assert (back.x_m, back.y_m) == pytest.approx((x, y), abs=1e-12)
    assert math.cos(back.heading_rad - heading) == pytest.approx(-1.0)
    again = back.reversed()
    assert (again.x_m, again.y_m) == pytest.approx((curve.x_m, curve.y_m), abs=1e-11)
    assert again.curvature_1pm == curve.curvature_1pm


@given(curves)
def test_message_round_trip(curve: Curve):
    again = Curve.from_message(curve.to_message())
    fraction = np.linspace(0, 1, 4)
    for mine, its in zip(curve.at(fraction * curve.length_m), again.at(fraction * again.length_m), strict=True):
        np.testing.assert_allclose(np.cos(its), np.cos(mine), atol=1e-8)
    assert again.length_m == pytest.approx(curve.length_m, rel=1e-9)


@pytest.mark.parametrize("far", [1e9, 1.2e308, math.inf, math.nan])
def test_a_message_of_a_place_on_no_field_is_refused(far: float):
    corner = Point(x=far, y=far)
    line = CurveMessage(type=CurveType(value=CurveType.LINE), line=(Line(end=corner),))
    arc = CurveMessage(type=CurveType(value=CurveType.ARC), arc=(Arc(start=corner, sweep_angle=1.0),))
    for message in (line, arc):
        with pytest.raises(ValueError, match="lie on a field"):
            Curve.from_message(message)


@given(st.lists(curves, min_size=1, max_size=5), st.floats(0, 1))
def test_path_table_agrees_with_its_curves(chain: list[Curve], fraction: float):
    table = PathTable.from_curves(chain)
    s = fraction * table.total_length_m
    index = int(table.index_at(s))
    expected = chain[index].at(s - table.starts_m[index])
    for mine, its in zip(table.at(s), expected, strict=True):
        assert float(mine) == pytest.approx(float(its), abs=1e-12)


@given(st.floats(-50, 50))
def test_wrapped_angles_point_the_same_way(angle_rad: float):
    wrapped = wrap_angle(angle_rad)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle_rad) == pytest.approx(1.0)
