"""Detection of edges between the lanes of an area, at which a path given by points reverses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


def lane_edges(points_m: NDArray[np.float64]) -> list[int]:
    """Find the indices of points (n, 2) at which the direction of travel turns by a right angle or more.

    The condition is Δp_k·Δp_{k+1} ≤ 0. The direction of travel reverses at a cusp, whereas the heading does not jump
    there, nor does the slope Δy/Δx, which is the same in both directions and has a pole besides. Points have to be
    further apart than their errors; of coinciding points the first counts.
    """
    moved = np.flatnonzero(np.any(np.diff(points_m, axis=0) != 0.0, axis=1)) + 1
    kept = np.concatenate(([0], moved))
    steps = np.diff(points_m[kept], axis=0)
    turned = np.sum(steps[:-1] * steps[1:], axis=1) <= 0.0
    return [int(index) for index in kept[1:-1][turned]]


def slope_edges(points_m: NDArray[np.float64]) -> list[int]:
    """Find edges in points (n, 2) by the study's rule: atan(Δy/Δx) changes by π/2 or more.

    Its errors are kept: the slope is the same in both directions along a line, and a vertical one has none.
    """
    steps = np.diff(points_m, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.arctan(steps[:, 1] / steps[:, 0])
        return [int(index) + 1 for index in np.flatnonzero(np.abs(np.diff(slope)) >= 0.5 * np.pi)]


class EdgeCase(NamedTuple):
    """Path given by points, with the number of edges found.

    Attributes:
        name: Description of the path.
        edges: True number of edges.
        by_slope: Number that the study's rule finds.
        by_direction: Number that `lane_edges` finds.
    """

    name: str
    edges: int
    by_slope: int
    by_direction: int


def edge_cases() -> list[EdgeCase]:
    """Cases of 5 m lanes with a point every 0.2 m, some with 1 mm of noise per axis."""
    noise = np.random.default_rng(1).normal(0.0, 0.001, (51, 2))
    there = np.linspace(0.0, 5.0, 26)
    back = np.concatenate((there, there[-2::-1]))
    along_x, along_y = np.column_stack((back, 0.0 * back)), np.column_stack((0.0 * there, there))
    cases = (
        ("there and back along x", 1, along_x),
        ("the same with noise", 1, along_x + noise),
        ("straight along y with noise", 0, along_y + noise[: len(along_y)]),
    )
    return [EdgeCase(name, edges, len(slope_edges(at)), len(lane_edges(at))) for name, edges, at in cases]
