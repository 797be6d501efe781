"""Smoothing: continuous in curvature where a plan is nearly so, as sent where it is painted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.onboard.rig import chain, trajectory
from touchline.onboard.trajectory.path_projection import pose_on
from touchline.onboard.trajectory.smoothing import (
    MAX_OFFSET_M,
    W_CURVATURE,
    W_LENGTH,
    W_SEGMENT,
    W_SHARPNESS,
    W_START,
)
from touchline.onboard.trajectory.trajectory import LoadedTrajectory, load_trajectory
from touchline.schemas.curves import Curve
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.segments.fit_arcs import cut

SPRAY_LEAD_M = 0.015


def turn(sharpness: float, curvature: float) -> PiecePath:
    """Straight, clothoid, arc, clothoid, straight."""
    ramp = abs(curvature) / sharpness
    slope = math.copysign(sharpness, curvature)
    pieces = (Piece(2.0), Piece(ramp, 0.0, slope), Piece(0.3, curvature), Piece(ramp, curvature, -slope), Piece(2.0))
    return PiecePath(PathPose(0.0, 0.0, 0.3), pieces)


def load(curves: list[Curve], *, spray: tuple[float, float] | None = None, backward: bool = False) -> LoadedTrajectory:
    every = tuple(range(len(curves))) if backward else ()
    sprays = () if spray is None else (spray,)
    return load_trajectory(trajectory(curves, 0.3, sprays, backward=every), Vehicle())


def joints(pieces: np.ndarray, sense: float = 1.0) -> np.ndarray:
    """(m − 1, 3) distance (m), kink (rad) and step of curvature (1/m) at the joints between pieces."""
    found = []
    for j in range(len(pieces) - 1):
        x, y, heading = pose_on(pieces, sense, j, pieces[j + 1, W_START])
        end = pieces[j, W_CURVATURE] + pieces[j, W_SHARPNESS] * pieces[j, W_LENGTH]
        gap = math.hypot(x - pieces[j + 1, 0], y - pieces[j + 1, 1])
        found.append((gap, abs(heading - pieces[j + 1, 2]), abs(end - pieces[j + 1, W_CURVATURE])))
    return np.array(found)


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize(("sharpness", "curvature"), [(1.0, -1.125), (1.0, 0.4), (3.0, 1.0), (15.0, -1.5)])
def test_cut_clothoids_become_continuous(sharpness: float, curvature: float, backward: bool) -> None:
    ideal = turn(sharpness, curvature)
    curves = [piece.curve for piece in cut(ideal)]
    plan = load(curves, backward=backward)
    assert np.abs(np.diff(plan.path[:, 3])).max() > 0.2
    pieces, sense = plan.pieces[0], -1.0 if backward else 1.0
    gap, kink, step = joints(pieces, sense).max(axis=0)
    assert gap < 2e-4
    assert kink < 1e-6
    assert step < 1e-4
    assert np.abs(pieces[:, W_SHARPNESS]).max() < 1.2 * sharpness
    for piece in pieces:
        pose = ideal.pose_at(float(piece[W_START]))
        assert math.hypot(piece[0] - pose.x_m, piece[1] - pose.y_m) < 2.0 * MAX_OFFSET_M


def test_a_painted_arc_is_followed_as_it_is_and_entered_with_its_curvature() -> None:
    curves = [piece.curve for piece in cut(PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(2.0), Piece(0.4, 0.0, 1.0))))]
    x, y, heading = curves[-1].end
    curves += chain((0.4, 3.0), x=x, y=y, heading=heading)
    start = sum(curve.length_m for curve in curves[:-1])
    plan = load(curves, spray=(start - SPRAY_LEAD_M, start + 2.9))
    pieces, last = plan.pieces[0], len(curves) - 1
    painted = pieces[pieces[:, W_SEGMENT] == last]
    assert len(painted) == 1
    assert painted[0, :5] == pytest.approx(plan.path[last, :5], abs=0.0)
    assert painted[0, W_SHARPNESS] == 0.0
    assert joints(pieces)[:, 2].max() < 1e-4


def test_a_step_that_is_meant_is_followed_as_it_is() -> None:
    plan = load(chain((0.0, 3.0), (1.0, 1.5), (0.0, 3.0)))
    pieces = plan.pieces[0]
    assert pieces[:, W_SHARPNESS] == pytest.approx(0.0, abs=1e-9)
    assert pieces[:, W_CURVATURE] == pytest.approx(plan.path[pieces[:, W_SEGMENT].astype(int), 3], abs=1e-9)


def test_small_gaps_and_kinks_are_bridged() -> None:
    curves = chain((0.0, 2.0))
    curves += chain((0.0, 2.0), x=2.0, y=0.0008, heading=0.0009)
    pieces = load(curves).pieces[0]
    gap, kink, _ = joints(pieces).max(axis=0)
    assert gap < 1e-5
    assert kink < 1e-6


def test_pieces_cover_the_path_in_order() -> None:
    plan = load([piece.curve for piece in cut(turn(1.0, 1.0))])
    pieces = plan.pieces[0]
    assert pieces[0, W_START] == 0.0
    assert pieces[1:, W_START] == pytest.approx(pieces[:-1, W_START] + pieces[:-1, W_LENGTH])
    assert pieces[-1, W_START] + pieces[-1, W_LENGTH] == pytest.approx(plan.total_length_m)
    rows = pieces[:, W_SEGMENT].astype(int)
    assert (plan.path[rows, 5] <= pieces[:, W_START] + 1e-12).all()
