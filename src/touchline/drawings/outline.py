"""Outlines: elements of a drawing of any format, as chains of straight, circular and smooth pieces."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from touchline.schemas.curves import Curve

Floats: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Smooth:
    """Parametric curve that is neither straight nor circular.

    Attributes:
        point: (n,) parameters to (n, 2) points, m.
        derivative: (n,) parameters to (n, 2) derivatives by the parameter.
        breaks: Parameters from begin to end, ascending or descending; between two of them the curve has no corner.
    """

    point: Callable[[Floats], Floats]
    derivative: Callable[[Floats], Floats]
    breaks: tuple[float, ...]


Piece: TypeAlias = Curve | Smooth


class Edge(Enum):
    """Rule for painting the line itself: always, unless its area is filled instead, or never."""

    PAINTED = 1
    UNLESS_FILLED = 2
    NEVER = 3


class FillRule(Enum):
    """Rule for the inside of rings: points with a nonzero, or with an odd, winding number."""

    NONZERO = "nonzero"
    EVEN_ODD = "evenodd"


@dataclass(frozen=True)
class Outline:
    """One unbroken line of a drawing.

    Attributes:
        name: Name of the element, unique in its file.
        pieces: Pieces, each beginning where the last one ends; lines and arcs are exact.
        closed: Whether it ends where it begins.
        filled: Whether its inside is coloured.
        edge: Whether the line itself is painted.
        area: Name of the element; outlines of one area make each other's holes.
        rule: Fill rule for that; None: the drawing has none.
        layers: Names of the enclosing layer or groups.
    """

    name: str
    pieces: tuple[Piece, ...]
    closed: bool = False
    filled: bool = False
    edge: Edge = Edge.PAINTED
    area: str = ""
    rule: FillRule | None = None
    layers: tuple[str, ...] = ()


def shifted(outline: Outline, by: Floats) -> Outline:
    """Move an outline by ``by``, (2,) m."""
    if not by.any():
        return outline
    return replace(outline, pieces=tuple(_moved(piece, by) for piece in outline.pieces))


def _moved(piece: Piece, by: Floats) -> Piece:
    if isinstance(piece, Smooth):
        return replace(piece, point=lambda t: piece.point(t) + by)
    return replace(piece, x_m=piece.x_m + float(by[0]), y_m=piece.y_m + float(by[1]))


def bezier(points: npt.ArrayLike) -> Smooth:
    """Bézier curve of any degree with these control points, (k, 2)."""
    control = np.asarray(points, dtype=np.float64)
    hodograph = (len(control) - 1) * np.diff(control, axis=0)
    breaks = tuple(np.linspace(0.0, 1.0, 3).tolist())
    return Smooth(lambda t: _de_casteljau(control, t), lambda t: _de_casteljau(hodograph, t), breaks)


def ellipse(center: npt.ArrayLike, first: npt.ArrayLike, second: npt.ArrayLike, begin: float, end: float) -> Smooth:
    """Curve center + first·cos t + second·sin t from ``begin`` to ``end`` (rad), half-diameters in m."""
    c, p, q = (np.asarray(v, dtype=np.float64) for v in (center, first, second))
    count = max(2, int(np.ceil(abs(end - begin) / (np.pi / 4))) + 1)
    return Smooth(
        lambda t: c + np.outer(np.cos(t), p) + np.outer(np.sin(t), q),
        lambda t: np.outer(np.cos(t), q) - np.outer(np.sin(t), p),
        tuple(np.linspace(begin, end, count).tolist()),
    )


def _de_casteljau(control: Floats, t: Floats) -> Floats:
    share = np.asarray(t, dtype=np.float64)[:, None, None]
    points = np.broadcast_to(control, (len(share), *control.shape))
    while points.shape[1] > 1:
        points = (1.0 - share) * points[:, :-1] + share * points[:, 1:]
    return np.asarray(points[:, 0])
