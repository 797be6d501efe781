"""Next legs: the next part of a robot's way, and how it is driven; and lines through points x + iy."""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from shapely import LineString
    from shapely.geometry.base import BaseGeometry

Complexes = NDArray[np.complex128]


class Manner(Enum):
    """Manner in which a robot drives a leg."""

    FREE = auto()
    """By the rules of open ground."""
    LANE = auto()
    """Straight to the aim, round others."""
    WAIT = auto()
    """Not yet: it stays where it is."""
    EXACT = auto()
    """On the straight line to the aim, where it comes to rest."""


class NextLeg(NamedTuple):
    """Next part of a robot's way.

    Attributes:
        aim: Point to drive at, x + iy (m).
        left_m: Length of the whole way that is left.
        manner: How it drives.
    """

    aim: complex
    left_m: float
    manner: Manner = Manner.FREE


def line_of(points: Complexes) -> LineString:
    """Return the line through points (m)."""
    import shapely

    return shapely.LineString(np.column_stack((points.real, points.imag)))


def points_of(line: BaseGeometry | NDArray[np.object_]) -> Complexes:
    """Return (k,) the points of a line, or of several points (m)."""
    import shapely

    corners = shapely.get_coordinates(line)
    found: Complexes = corners[:, 0] + 1j * corners[:, 1]
    return found
