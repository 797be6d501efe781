"""Chains without dust, and outlines that come twice."""

import math

import pytest

from touchline.drawings.detail import Detail
from touchline.drawings.repeats import Repeats
from touchline.drawings.welding import stretched, welded
from touchline.schemas.curves import Curve


def test_an_arc_that_is_to_end_where_it_begins_is_a_full_circle():
    nearly = Curve(0.0, 0.0, 0.3, -2.0, 0.999 * math.pi)
    circle = stretched(nearly, (1.0, 2.0), (1.0, 2.0))
    assert circle.length_m == nearly.length_m
    assert circle.curvature_1pm * circle.length_m == pytest.approx(-2.0 * math.pi)
    assert circle.end[:2] == pytest.approx((1.0, 2.0), abs=1e-9)


@pytest.mark.parametrize("first", ["dust", "arc"])
def test_a_nearly_closed_arc_and_dust_are_welded_to_a_circle(first):
    arc = Curve(0.0, 0.0, 0.0, 1.0, 2.0 * math.pi - 0.001)
    dust = Curve.from_line(arc.end[:2], (0.0, 0.0))
    (circle,) = welded([dust, arc] if first == "dust" else [arc, dust], closed=True, least_m=0.01)
    assert circle.end[:2] == pytest.approx((circle.x_m, circle.y_m), abs=1e-9)
    assert circle.length_m == pytest.approx(2.0 * math.pi, abs=0.01)


@pytest.mark.parametrize("shift", [0.0, 0.0004, -0.0004])
def test_what_lies_on_another_outline_is_found_wherever_the_grid_parts_them(shift):
    detail, repeats = Detail.of(0.12), Repeats()
    x = 7 * detail.tolerance_m  # where a cell begins
    assert not repeats.has([Curve.from_line((x, 0.0), (x + 1.0, 0.0))], detail)
    assert repeats.has([Curve.from_line((x + 1.0 + shift, 0.0), (x + shift, 0.0))], detail)
    assert not repeats.has([Curve.from_line((x, 0.1), (x + 1.0, 0.1))], detail)
    assert repeats.count == 1
