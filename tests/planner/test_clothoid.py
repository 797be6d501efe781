"""Pieces of constant sharpness: known integrals, composition, sampling."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import fresnel

from tests.planner.strategies import floats, moves, pieces, poses
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined


@pytest.mark.parametrize("sharpness", [1.0, 2.1, 15.75, 1e-3, 0.3])
def test_clothoid_is_the_fresnel_integral(sharpness: float) -> None:
    length = 1.125 / sharpness
    scale = math.sqrt(math.pi / sharpness)
    s, c = fresnel(length / scale)
    end = Piece(length, 0.0, sharpness).displacement_at(length)
    assert abs(end - scale * complex(c, s)) <= 1e-12 * max(1.0, length)


def test_line_and_quarter_arc_are_exact() -> None:
    assert Piece(3.0).displacement_at(3.0) == 3.0
    quarter = PiecePath(PathPose(1.0, 2.0, 0.0), (Piece(math.pi, 0.5),)).end
    assert quarter == pytest.approx((3.0, 4.0, math.pi / 2), abs=1e-15)


@given(floats(-2.0, 2.0), floats(0.0, 3.0))
def test_vanishing_sharpness_is_an_arc(curvature: float, length: float) -> None:
    arc, clothoid = Piece(length, curvature), Piece(length, curvature, 1e-16)
    assert abs(arc.displacement_at(length) - clothoid.displacement_at(length)) < 1e-14


@given(poses, pieces, floats(0.0, 1.0))
def test_a_cut_piece_goes_on_where_it_was_cut(start: PathPose, piece: Piece, share: float) -> None:
    s = share * piece.length_m
    first = piece._replace(length_m=s)
    second = piece._replace(length_m=piece.length_m - s, curvature_1pm=piece.curvature_at(s))
    whole, parts = PiecePath(start, (piece,)).end, PiecePath(start, (first, second)).end
    assert abs(whole.point - parts.point) < 1e-12
    assert whole.heading_rad == pytest.approx(parts.heading_rad, abs=1e-12)


@given(poses, st.lists(moves, max_size=5))
def test_sampling_agrees_with_single_poses(start: PathPose, chain: list[Piece]) -> None:
    path = PiecePath(start, tuple(chain))
    s = np.linspace(0.0, path.length_m, 7)
    x, y, heading, _ = path.sample(s)
    for k in range(len(s)):
        pose = path.pose_at(float(s[k]))
        assert (x[k], y[k], heading[k]) == pytest.approx(tuple(pose), abs=1e-12)


def test_long_spirals_are_integrated_panel_by_panel() -> None:
    piece = Piece(20.0, 0.0, 1.0)
    s, c = fresnel(20.0 / math.sqrt(math.pi))
    assert abs(piece.displacement_at(20.0) - math.sqrt(math.pi) * complex(c, s)) < 1e-11


def test_joined_merges_lines_and_arcs_and_drops_empty_pieces() -> None:
    chain = (Piece(1.0), Piece(0.0, 2.0), Piece(2.0), Piece(1.0, 0.5), Piece(1.0, 0.5), Piece(1.0, 0.5, 1.0))
    assert joined(chain) == (Piece(3.0), Piece(2.0, 0.5), Piece(1.0, 0.5, 1.0))


def test_turning_on_the_spot_moves_nothing() -> None:
    path = PiecePath(PathPose(1.0, 2.0, 0.0), (Piece.spin(math.pi / 2), Piece(3.0), Piece.spin(-1.0)))
    assert path.length_m == 3.0
    assert path.end == pytest.approx((1.0, 5.0, math.pi / 2 - 1.0), abs=1e-15)
    assert path.pose_at(0.0).heading_rad == math.pi / 2
    assert path.pose_at(3.0) == path.end


@given(poses, st.lists(moves, max_size=4))
def test_the_way_back_leads_back(start: PathPose, chain: list[Piece]) -> None:
    """The pieces in reverse order and direction, bent as before: backward with (κ, σ) undoes forward."""
    back = (Piece(p.length_m, p.curvature_end_1pm, -p.sharpness_1pm2, -p.direction, -p.spin_rad) for p in chain[::-1])
    path = PiecePath(start, (*chain, *back))
    assert abs(path.end.point - start.point) < 1e-12
    assert path.end.heading_rad == pytest.approx(start.heading_rad, abs=1e-12)


@given(poses, moves)
def test_a_piece_obeys_its_differential_equations(start: PathPose, piece: Piece) -> None:
    path, s, h = PiecePath(start, (piece,)), 0.5 * piece.length_m, 1e-5
    if piece.length_m < 0.1:
        return
    x, y, heading, curvature = path.sample(np.array([s - h, s, s + h]))
    assert complex(x[2] - x[0], y[2] - y[0]) / (2 * h) == pytest.approx(
        piece.direction * cmath.rect(1.0, heading[1]), abs=1e-7
    )
    assert (heading[2] - heading[0]) / (2 * h) == pytest.approx(piece.direction * curvature[1], abs=1e-7)
    assert (curvature[2] - curvature[0]) / (2 * h) == pytest.approx(piece.sharpness_1pm2, abs=1e-7)
