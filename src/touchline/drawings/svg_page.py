"""Page of an SVG drawing: size, scale and edge."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self
from xml.etree.ElementTree import Element

import numpy as np

from touchline.drawings.outline import Floats
from touchline.drawings.svg_lengths import PX_M, UNITS_M, SvgViewport, fitted, split_length, view_box
from touchline.drawings.svg_style import Style
from touchline.schemas.errors import SpecError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

#: Maximum scale of a view box, and of a unit in metres, for the precision of numbers.
MOST_SCALE = 1e9


@dataclass(frozen=True)
class SvgPage:
    """Page of a root element, with its user units.

    Attributes:
        visible: Whether anything can show.
        matrix: (3, 3) from user units to metres, y up; the user's origin stays the origin.
        fit: (3, 3) from user units to pixels of the page.
        viewport: Reference of lengths.
        edge: Polygon of the page, m; None: it has no size.
    """

    visible: bool
    matrix: Floats
    fit: Floats
    viewport: SvgViewport
    edge: "BaseGeometry | None"

    @classmethod
    def of(cls, source: str, root: Element, style: Style, scale_m: float | None) -> Self:
        """Determine the page of a root element.

        Args:
            source: Name of the file, for errors.
            root: Outermost svg element.
            style: Style of the root.
            scale_m: Metres per user unit along x; None: from width or height.

        Raises:
            SpecError: The size in metres is unknown, or too large or too small.
        """
        written = [split_length(style[side]) for side in ("width", "height")]
        box = view_box(root.get("viewBox"))
        if scale_m is None and not any(side is not None and side[1] in UNITS_M for side in written):
            problem = "has no width or height in a unit of length"
            raise SpecError(source, "svg", problem, "give the metres of one user unit with --scale")
        known = [None if side is None or side[1] == "%" or side[0] < 0.0 else side for side in written]
        plain = SvgViewport(0.0, 0.0)
        sides = [None if side is None else plain.length(f"{side[0]}{side[1]}", "", 0.0) for side in known]
        visible = 0.0 not in sides and (box is None or min(box[2:]) > 0.0)
        if not visible:
            return cls(False, np.eye(3), np.eye(3), plain, None)
        size = _size(sides, box)
        inner = size if box is None else box[2:]
        width, height = (math.nan if side is None else side for side in inner)
        paper = (size[0] or 100.0, size[1] or 100.0)
        fit = np.eye(3) if box is None else fitted(box, paper, root.get("preserveAspectRatio"))
        across, down = (float(fit[0, 0]), float(fit[1, 1]))
        metres = PX_M * across if scale_m is None else scale_m
        smallest, largest = 1 / MOST_SCALE, MOST_SCALE
        if not all(smallest <= abs(factor) <= largest for factor in (metres, across, down)):
            remedy = f"give it a viewBox that is scaled by {smallest:g} to {largest:g}, or none"
            raise SpecError(source, "viewBox", "cannot be carried to metres", remedy)
        matrix = np.diag([metres, -metres * down / across, 1.0])
        viewport = SvgViewport(width, height, page=paper)
        edge = None if None in size else _edge(matrix @ np.linalg.inv(fit), paper)
        return cls(True, matrix, fit, viewport, edge)


def _size(
    sides: list[float | None], box: tuple[float, float, float, float] | None
) -> tuple[float | None, float | None]:
    """Width and height in pixels; one that is missing follows from the view box's ratio."""
    width, height = sides
    if box is None:
        return width, height
    if width is None and height is None:
        return box[2], box[3]
    if width is None:
        assert height is not None
        return height * box[2] / box[3], height
    return width, width * box[3] / box[2] if height is None else height


def _edge(matrix: Floats, size: tuple[float, float]) -> "BaseGeometry":
    import shapely

    (x1, y1), (x2, y2) = (matrix @ (0.0, 0.0, 1.0))[:2], (matrix @ (*size, 1.0))[:2]
    edge: BaseGeometry = shapely.box(min(x1, x2), min(y1, y2), max(x1, x2), max(y1, y2))
    return edge
