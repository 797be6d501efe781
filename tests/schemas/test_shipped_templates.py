"""The shipped templates against the Laws of the Game, computed here anew from the Laws' own figures."""

import math
from functools import cache

import numpy as np
import pytest
from shapely import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from touchline.schemas.catalogue import load_template, shipped_templates
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

WIDTH_M = 0.12
FINE = 2048  # segments per quarter circle of the ideal areas


@cache
def pitch() -> Template:
    return load_template("soccer-11")


def painted(template: Template) -> BaseGeometry:
    """The ground that a perfect nozzle paints: each stroke as wide as the line, with square ends."""
    strokes = []
    for segment in template.segments:
        curve = segment.curve()
        count = 2 if curve.curvature_1pm == 0 else 8001
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count))
        line = LineString(np.column_stack((x, y)))
        strokes.append(line.buffer(template.line_width_m / 2, cap_style="flat", join_style="mitre"))
    return unary_union(strokes)


def frame(x0: float, y0: float, x1: float, y1: float) -> BaseGeometry:
    """The line along the inside of a rectangle's edge."""
    inner = box(x0 + WIDTH_M, y0 + WIDTH_M, x1 - WIDTH_M, y1 - WIDTH_M)
    return box(x0, y0, x1, y1).difference(inner)


def ring(x: float, y: float, radius: float) -> BaseGeometry:
    """The line along the inside of a circle."""
    outer, inner = (Point(x, y).buffer(r, quad_segs=FINE) for r in (radius, radius - WIDTH_M))
    return outer.difference(inner)


def laws_of_the_game() -> BaseGeometry:
    """Law 1: every dimension is to the outside of the line, which belongs to the area that it bounds."""
    field = box(-52.5, -34.0, 52.5, 34.0)
    areas = [frame(-52.5, -34.0, 52.5, 34.0), ring(0.0, 0.0, 9.15)]
    areas.append(box(-WIDTH_M / 2, -34.0, WIDTH_M / 2, 34.0))
    areas.append(box(-0.12, -WIDTH_M / 2, 0.12, WIDTH_M / 2))
    for side in (-1, 1):
        for depth in (5.5, 16.5):
            half_width = 7.32 / 2 + depth
            near, far = side * 52.5, side * (52.5 - depth)
            areas.append(frame(min(near, far), -half_width, max(near, far), half_width))
        mark = side * (52.5 - 11.0)
        areas.append(box(mark - 0.12, -WIDTH_M / 2, mark + 0.12, WIDTH_M / 2))
        x0, x1 = sorted((side * 52.5, side * (52.5 - 16.5)))
        areas.append(ring(mark, 0.0, 9.15).difference(box(x0, -20.16, x1, 20.16)))
        areas += [ring(side * 52.5, y, 1.0).intersection(field) for y in (-34.0, 34.0)]
    return unary_union(areas)


def test_the_pitch_is_painted_as_the_laws_have_it() -> None:
    """Missing and surplus paint together are less than the rounding of circles to polygons."""
    difference = painted(pitch()).symmetric_difference(laws_of_the_game())
    assert difference.area < 1e-4
    assert difference.buffer(-1e-3).is_empty  # nowhere wider than 2 mm


def test_every_arc_can_be_driven_with_the_nozzle_on_the_right() -> None:
    """The axle centre runs beside the nozzle: its curvature must be within the vehicle's."""
    vehicle = Vehicle()
    for segment in pitch().segments:
        axle = segment.curve().offset(-vehicle.tool.nozzle_y_m)
        assert abs(axle.curvature_1pm) <= vehicle.drive.default_kappa_max_1pm, segment.id


def test_no_wheel_rolls_over_the_boundary_once_it_is_painted() -> None:
    """The boundary comes last, clockwise, so that the robot is outside the pitch while it paints it."""
    last = pitch().segments[-4:]
    assert [segment.id for segment in last] == [
        "goal-line-east",
        "touchline-south",
        "goal-line-west",
        "touchline-north",
    ]
    wheel_m = -Vehicle().tool.nozzle_y_m - Vehicle().drive.track_width_m / 2
    inside = Polygon([(-52.5, -34.0), (52.5, -34.0), (52.5, 34.0), (-52.5, 34.0)])
    for segment in last:
        x, y, _, _ = segment.curve().offset(wheel_m).at(segment.curve().length_m / 2)
        assert not inside.contains(Point(float(x), float(y))), segment.id


@pytest.mark.parametrize("name", sorted(shipped_templates()))
def test_every_shipped_template_loads_under_its_own_name(name: str) -> None:
    template = load_template(name)
    assert template.name == name
    assert template.title and "rigin at" in template.source
    assert all(segment.label for segment in template.segments)


def test_the_square_is_closed_and_clockwise() -> None:
    curves = [segment.curve() for segment in load_template("study-square").segments]
    corners = [(curve.x_m, curve.y_m) for curve in curves]
    assert [curve.end[:2] for curve in curves] == [pytest.approx(corner) for corner in corners[1:] + corners[:1]]
    area = sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True)) / 2
    assert area == pytest.approx(-1.0)
    assert math.isclose(load_template("study-square").length_m, 4.0)
