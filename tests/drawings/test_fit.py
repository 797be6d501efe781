"""Smooth curves as lines and arcs: never further than 1 mm, headings kept."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from touchline.drawings.deviation import apart_m, distance_m, sampled
from touchline.drawings.fit import TOLERANCE_M, fit, fit_outline
from touchline.drawings.outline import Outline, Smooth, bezier, ellipse
from touchline.drawings.slivers import paintable, without_slivers
from touchline.schemas.curves import Curve
from touchline.schemas.template import MIN_LENGTH_M

coordinates = st.floats(-20.0, 20.0, allow_nan=False).map(lambda value: round(value, 6))
points = st.tuples(coordinates, coordinates)


def painted(outline: Outline) -> list[Curve]:
    """The lines and arcs of an outline, all of which a template may hold."""
    curves = fit_outline(outline)
    return without_slivers(curves) if curves else []


def both_ways(smooth: Smooth, curves: list[Curve]) -> float:
    """The Hausdorff distance between a curve and its fit, by dense samples."""
    t = np.concatenate([np.linspace(a, b, 4001) for a, b in zip(smooth.breaks, smooth.breaks[1:], strict=False)])
    there = smooth.point(t)
    forth = float(distance_m(there, curves).max())
    fitted = np.concatenate([np.column_stack(c.at(np.linspace(0.0, c.length_m, 60))[:2]) for c in curves])
    back = float(cKDTree(there).query(fitted)[0].max())
    spacing = float(np.hypot(*np.diff(there, axis=0).T).max())
    return max(forth, math.sqrt(max(back**2 - (spacing / 2) ** 2, 0.0)))


def steps(curves: list[Curve]) -> tuple[float, float]:
    """Largest gap (m) and largest step of heading (rad) from curve to curve."""
    gaps = [math.hypot(a.end[0] - b.x_m, a.end[1] - b.y_m) for a, b in itertools.pairwise(curves)]
    turns = [abs(math.remainder(a.end[2] - b.heading_rad, 2 * math.pi)) for a, b in itertools.pairwise(curves)]
    return max(gaps, default=0.0), max(turns, default=0.0)


def near_ends(curve: Curve) -> np.ndarray:
    """Points of a curve, dense near its ends."""
    close = np.linspace(0.0, min(curve.length_m, 0.05), 60)
    stations = np.concatenate((close, np.linspace(0.0, curve.length_m, 20), curve.length_m - close))
    return np.column_stack(curve.at(stations)[:2])


def apart(first: Sequence[Curve], second: Sequence[Curve]) -> float:
    """Largest distance of a point of either from the other, m."""
    there, back = (np.concatenate([near_ends(curve) for curve in curves]) for curves in (first, second))
    return max(float(distance_m(there, second).max()), float(distance_m(back, first).max()))


def polyline(*points: tuple[float, float]) -> list[Curve]:
    return [Curve.from_line(a, b) for a, b in itertools.pairwise(points)]


def chain(parts: list[tuple[float, float, float]]) -> list[Curve]:
    """Lines and arcs by length (m), curvature (1/m), and the turn between them (rad)."""
    curves: list[Curve] = []
    x, y, heading = 0.0, 0.0, 0.0
    for length, curvature, turn in parts:
        curves.append(Curve(x, y, heading, curvature, min(length, 6.28 / max(abs(curvature), 1e-9))))
        x, y, heading = curves[-1].end
        heading += turn
    return curves


lengths = st.one_of(st.floats(1e-4, 0.004), st.floats(0.002, 0.013), st.floats(0.01, 0.05), st.floats(0.1, 14.0))
curvatures = st.one_of(st.just(0.0), st.floats(0.5, 3000.0), st.floats(-3000.0, -0.5))
turns = st.one_of(st.sampled_from([0.0, math.pi]), st.floats(-math.pi, math.pi), st.floats(2.9, 3.4))


def tightest_radius(smooth: Smooth) -> float:
    """0 where it comes to a stand, as at a cusp."""
    t = np.linspace(smooth.breaks[0], smooth.breaks[-1], 4001)
    d1 = smooth.derivative(t)
    if np.hypot(*d1.T).min() < 0.01 * np.hypot(*d1.T).max():
        return 0.0
    d2 = np.gradient(d1, t, axis=0)
    cross = np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    return float((np.hypot(*d1.T) ** 3 / np.maximum(cross, 1e-12)).min())


@given(st.lists(points, min_size=3, max_size=4))
@settings(max_examples=12, deadline=None)
def test_a_bezier_is_followed_within_a_millimetre(control: list[tuple[float, float]]) -> None:
    smooth = bezier(control)
    assume(tightest_radius(smooth) > 0.05)
    curves = painted(Outline("curve", (smooth,)))
    assert both_ways(smooth, curves) <= TOLERANCE_M
    gap, turn = steps(curves)
    assert gap < 1e-9 and turn < 1e-6
    assert min(c.length_m for c in curves) >= MIN_LENGTH_M
    assert (curves[0].x_m, curves[0].y_m) == pytest.approx(control[0], abs=1e-12)
    assert curves[-1].end[:2] == pytest.approx(control[-1], abs=1e-9)


@given(st.lists(points, min_size=3, max_size=4))
@settings(max_examples=9, deadline=None)
def test_the_stated_deviation_is_the_true_one(control: list[tuple[float, float]]) -> None:
    """Cusps, loops and degenerate handles as well: what cannot be met is at least told."""
    smooth = bezier(control)
    outline = Outline("curve", (smooth,))
    curves = painted(outline)
    assume(curves)
    drawn = fit_outline(outline)
    assert apart_m(drawn, curves)[0] == pytest.approx(apart_m(drawn, curves, most=5000)[0], abs=1e-3)
    assert distance_m(sampled(smooth, 5000), curves).max() < 5e-3
    assert steps(curves)[0] < 1e-9


@given(st.lists(st.tuples(lengths, st.just(0.0), turns), min_size=1, max_size=25))
@settings(max_examples=12, deadline=None)
def test_lines_of_any_length_are_bridged_within_half_the_shortest(parts: list[tuple[float, float, float]]) -> None:
    """Hairpins, saws, dust: both ways."""
    drawn = chain(parts)
    curves = painted(Outline("lines", tuple(drawn)))
    assert apart(drawn, curves or [Curve(0.0, 0.0, 0.0, 0.0, 0.0)]) < MIN_LENGTH_M / 2 + 1e-6
    assert steps(curves)[0] < 1e-9
    assert all(paintable(curve) for curve in curves)


@given(st.lists(st.tuples(lengths, curvatures, turns), min_size=1, max_size=25))
@settings(max_examples=9, deadline=None)
def test_so_are_arcs_of_any_length_and_radius(parts: list[tuple[float, float, float]]) -> None:
    """But for what they bulge between the points looked at."""
    drawn = chain(parts)
    curves = painted(Outline("arcs", tuple(drawn)))
    assert apart(drawn, curves or [Curve(0.0, 0.0, 0.0, 0.0, 0.0)]) < MIN_LENGTH_M / 2 + 1e-4
    assert steps(curves)[0] < 1e-9
    assert all(paintable(curve) for curve in curves)


@pytest.mark.parametrize("legs", [(14.0, 0.375), (0.375, 14.0), (5.0, 5.0), (14.0, 0.009), (0.007, 14.0)])
def test_the_tip_of_a_hairpin_is_reached(legs: tuple[float, float]) -> None:
    """Out and back by one way, in one Bézier curve: its last centimetre may be too short for a line of a template."""
    first, second = legs
    tip = math.sqrt(first) / (math.sqrt(first) + math.sqrt(second))
    smooth = bezier([(0.0, first), (0.0, -first * (1 - tip) / tip), (0.0, second)])
    curves = painted(Outline("hairpin", (smooth,)))
    assert both_ways(smooth, curves) < 5e-3
    assert min(c.length_m for c in curves) >= MIN_LENGTH_M


def test_only_the_neighbourhood_of_a_sliver_changes() -> None:
    half = Curve.from_arc((0.0, 0.0), (0.0, 5.0), math.pi)
    drawn = [Curve.from_line((-9.0, 0.0), (0.0, 0.0)), half, *polyline((0.0, 10.0), (0.0, 10.004), (-9.0, 10.004))]
    curves = painted(Outline("pitch end", tuple(drawn)))
    assert curves[0] == drawn[0]
    assert (curves[1].x_m, curves[1].y_m, curves[1].heading_rad, curves[1].curvature_1pm) == (0.0, 0.0, 0.0, 0.2)
    assert curves[1].length_m > half.length_m - 0.03
    assert curves[-1].length_m > 9.0 - 0.03
    assert apart(drawn, curves) < 2.1e-3


@given(st.floats(0.1, 20.0), st.floats(0.1, 20.0), st.floats(-7.0, 7.0), st.floats(0.1, 6.28), st.booleans())
@settings(max_examples=9, deadline=None)
def test_an_ellipse_is_followed_within_a_millimetre(a: float, b: float, begin: float, sweep: float, back: bool) -> None:
    assume(min(a, b) ** 2 / max(a, b) > 0.05)
    smooth = ellipse((3.0, -2.0), (a, 0.0), (0.0, b), begin, begin - sweep if back else begin + sweep)
    curves = fit(smooth)
    assert both_ways(smooth, curves) <= TOLERANCE_M
    assert steps(curves)[1] < 1e-6


def test_few_arcs_suffice() -> None:
    quarter = 4 / 3 * math.tan(math.pi / 8)
    circle = bezier([(10, 0), (10, 10 * quarter), (10 * quarter, 10), (0, 10)])
    assert len(fit(circle)) <= 8
    straight = fit(bezier([(0, 0), (1, 1), (5, 5), (9, 9)]))
    assert all(c.curvature_1pm == 0.0 for c in straight)
