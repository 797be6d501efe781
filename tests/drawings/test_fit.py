"""Smooth curves as lines and arcs: never further than 1 mm, headings kept."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from schemas.curves import Curve
from schemas.template import MIN_LENGTH_M
from services.drawings.fit import TOLERANCE_M, deviation_m, distance_m, fit, fit_outline
from services.drawings.outline import Outline, Smooth, bezier, ellipse

coordinates = st.floats(-20.0, 20.0, allow_nan=False).map(lambda value: round(value, 6))
points = st.tuples(coordinates, coordinates)


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
@settings(max_examples=80, deadline=None)
def test_a_bezier_is_followed_within_a_millimetre(control: list[tuple[float, float]]) -> None:
    smooth = bezier(control)
    assume(tightest_radius(smooth) > 0.05)
    curves = fit_outline(Outline("curve", (smooth,)))
    assert both_ways(smooth, curves) <= TOLERANCE_M
    gap, turn = steps(curves)
    assert gap < 1e-9 and turn < 1e-6
    assert min(c.length_m for c in curves) >= MIN_LENGTH_M
    assert (curves[0].x_m, curves[0].y_m) == pytest.approx(control[0], abs=1e-12)
    assert curves[-1].end[:2] == pytest.approx(control[-1], abs=1e-9)


@given(st.lists(points, min_size=3, max_size=4))
@settings(max_examples=60, deadline=None)
def test_the_stated_deviation_is_the_true_one(control: list[tuple[float, float]]) -> None:
    """Cusps, loops and degenerate handles as well: what cannot be met is at least told.

    A way there and back that is shorter than a template's shortest line is left out, with its tip.
    """
    outline = Outline("curve", (bezier(control),))
    curves = fit_outline(outline)
    assume(curves)
    dense = deviation_m(outline, curves, samples=5000)
    assert deviation_m(outline, curves) == pytest.approx(dense, abs=1e-3)
    assert dense < MIN_LENGTH_M + TOLERANCE_M
    assert steps(curves)[0] < 1e-9


@given(st.floats(0.1, 20.0), st.floats(0.1, 20.0), st.floats(-7.0, 7.0), st.floats(0.1, 6.28), st.booleans())
@settings(max_examples=60, deadline=None)
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


def test_tiny_features_are_bridged_and_specks_dropped() -> None:
    zigzag = tuple(
        Curve.from_line((i * 0.004, i % 2 * 0.002), ((i + 1) * 0.004, (i + 1) % 2 * 0.002)) for i in range(9)
    )
    curves = fit_outline(Outline("zigzag", zigzag))
    assert min(c.length_m for c in curves) >= MIN_LENGTH_M
    assert steps(curves)[0] < 1e-9
    assert deviation_m(Outline("zigzag", zigzag), curves) < 3e-3
    assert fit_outline(Outline("speck", (Curve.from_line((0, 0), (0.004, 0.0)),))) == []
