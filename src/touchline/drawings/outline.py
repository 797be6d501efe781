"""What a drawing's elements are, whatever file they come from: chains of straight, circular and smooth pieces."""

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
    """A curve that is neither straight nor circular, by its parameter.

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
    """Whether the line itself is painted: always, unless its area is filled instead, or never."""

    PAINTED = 1
    UNLESS_FILLED = 2
    NEVER = 3


class FillRule(Enum):
    """Which places rings enclose: those that they go round at all, or an odd number of times."""

    NONZERO = "nonzero"
    EVEN_ODD = "evenodd"


@dataclass(frozen=True)
class Outline:
    """One unbroken line of a drawing.

    Attributes:
        name: The element's name, unique in its file.
        pieces: One after another, each beginning where the last one ends; lines and arcs are exact.
        closed: Whether it ends where it begins.
        filled: Whether its inside is coloured.
        edge: Whether the line itself is painted.
        area: Name of the element; outlines of one area make each other's holes.
        rule: Which of them do; None: the drawing does not say.
        layers: Names of what it lies in: a layer, or a group in a group.
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
    """The outline moved by ``by``, (2,) m."""
    if not by.any():
        return outline
    return replace(outline, pieces=tuple(_moved(piece, by) for piece in outline.pieces))


def _moved(piece: Piece, by: Floats) -> Piece:
    if isinstance(piece, Smooth):
        return replace(piece, point=lambda t: piece.point(t) + by)
    return replace(piece, x_m=piece.x_m + float(by[0]), y_m=piece.y_m + float(by[1]))


def bezier(points: npt.ArrayLike) -> Smooth:
    """The Bézier curve of any degree with these control points, (k, 2)."""
    control = np.asarray(points, dtype=np.float64)
    hodograph = (len(control) - 1) * np.diff(control, axis=0)
    breaks = tuple(np.linspace(0.0, 1.0, 3).tolist())
    return Smooth(lambda t: _de_casteljau(control, t), lambda t: _de_casteljau(hodograph, t), breaks)


def ellipse(center: npt.ArrayLike, first: npt.ArrayLike, second: npt.ArrayLike, begin: float, end: float) -> Smooth:
    """The curve center + first·cos t + second·sin t from ``begin`` to ``end`` (rad), half-diameters in m."""
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
