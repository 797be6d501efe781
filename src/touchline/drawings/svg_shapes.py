"""SVG shapes as subpaths, in user units: SVG 2, chapters 9 and 10."""

import math
import re
from collections.abc import Callable
from xml.etree.ElementTree import Element

import numpy as np

from touchline.drawings.outline import Floats
from touchline.drawings.path_data import Drawn, EllipseArc, SubPath, parse_path
from touchline.drawings.svg_lengths import SvgViewport
from touchline.drawings.svg_style import Style

Shape = tuple[list[SubPath], str]
_CSS_PATH = re.compile(r"path\(\s*(?:[a-z]+\s*,\s*)?(['\"])(.*)\1\s*\)", re.DOTALL)
_POINTS = re.compile(r"[\s,]*([+-]?(?:[0-9]*\.[0-9]+|[0-9]+)(?:[eE][+-]?[0-9]+)?)")


def shape_of(kind: str, element: Element, style: Style, viewport: SvgViewport) -> Shape:
    """Subpaths of a shape, and the error in it, "" if there is none.

    Args:
        kind: One of `SHAPES`.
        element: Element, for attributes that are no properties.
        style: Style, for properties.
        viewport: Reference of lengths.
    """
    calculated = next(
        (name for name in ("x", "y", "width", "height", "cx", "cy", "r", "rx", "ry") if "calc(" in style[name]), ""
    )
    if calculated:
        return [], f"its {calculated} is calculated; give it a number"
    return SHAPES[kind](element, style, viewport)


def _path(_element: Element, style: Style, _viewport: SvgViewport) -> Shape:
    text = style["d"]
    css = _CSS_PATH.fullmatch(text)
    if text == "none":
        return [], ""
    subpaths, error = parse_path(css[2] if css else text)
    return subpaths, f"its path data {error}, and is painted up to there; mend its d" if error else ""


def _rect(_element: Element, style: Style, viewport: SvgViewport) -> Shape:
    x, y = viewport.length(style["x"], "x", 0.0), viewport.length(style["y"], "y", 0.0)
    width, height = viewport.length(style["width"], "x", 0.0), viewport.length(style["height"], "y", 0.0)
    if width < 0.0 or height < 0.0:
        return [], "its width or height is negative; give it a positive one"
    if not (width and height):
        return [], ""
    rx, ry = viewport.length(style["rx"], "x", -1.0), viewport.length(style["ry"], "y", -1.0)
    rx, ry = (ry if rx < 0.0 else rx), (rx if ry < 0.0 else ry)
    rx, ry = min(max(rx, 0.0), width / 2), min(max(ry, 0.0), height / 2)
    if not (rx and ry):
        rx = ry = 0.0
    right, bottom = x + width, y + height
    inner = ((right - rx, y + ry), (right - rx, bottom - ry), (x + rx, bottom - ry), (x + rx, y + ry))
    pieces: list[Drawn] = []
    at = np.array([x + rx, y])
    for k, (center, corner) in enumerate(zip(inner, ((right, y), (right, bottom), (x, bottom), (x, y)), strict=True)):
        begin = (k - 1) * math.pi / 2
        arc = _quarter(np.array(center), (rx, ry), begin)
        first, last = (_on(arc, begin), _on(arc, begin + math.pi / 2)) if rx else (np.array(corner), np.array(corner))
        if not np.array_equal(at, first):
            pieces.append(np.array([at, first]))
        if rx:
            pieces.append(arc)
        at = last
    return [SubPath(np.array([x + rx, y]), pieces, True)], ""


def _circle(_element: Element, style: Style, viewport: SvgViewport) -> Shape:
    radius = viewport.length(style["r"], "", 0.0)
    return _round(style, viewport, (radius, radius))


def _ellipse(_element: Element, style: Style, viewport: SvgViewport) -> Shape:
    rx, ry = viewport.length(style["rx"], "x", math.nan), viewport.length(style["ry"], "y", math.nan)
    rx, ry = (ry if math.isnan(rx) else rx), (rx if math.isnan(ry) else ry)
    return _round(style, viewport, (0.0 if math.isnan(rx) else rx, 0.0 if math.isnan(ry) else ry))


def _round(style: Style, viewport: SvgViewport, radii: tuple[float, float]) -> Shape:
    if min(radii) < 0.0:
        return [], "its radius is negative; give it a positive one"
    if not all(radii):
        return [], ""
    center = np.array([viewport.length(style["cx"], "x", 0.0), viewport.length(style["cy"], "y", 0.0)])
    pieces: list[Drawn] = [_quarter(center, radii, k * math.pi / 2) for k in range(4)]
    return [SubPath(center + np.array([radii[0], 0.0]), pieces, True)], ""


def _line(element: Element, _style: Style, viewport: SvgViewport) -> Shape:
    x1, y1, x2, y2 = (viewport.length(element.get(f"{axis}{end}"), axis, 0.0) for end in "12" for axis in "xy")
    return [SubPath(np.array([x1, y1]), [np.array([[x1, y1], [x2, y2]])])], ""


def _polyline(element: Element, _style: Style, _viewport: SvgViewport, closed: bool = False) -> Shape:
    text, numbers, position = element.get("points", ""), [], 0
    while found := _POINTS.match(text, position):
        numbers.append(float(found[1]))
        position = found.end()
    wrong = bool(text[position:].strip(" \t\r\n\f,")) or len(numbers) % 2 == 1
    error = "its points have an error, and are painted up to there; mend them" if wrong else ""
    points = np.reshape(numbers[: len(numbers) // 2 * 2], (-1, 2))
    if len(points) < 2:
        return [], error
    chain = np.vstack((points, points[:1])) if closed else points
    return [SubPath(points[0], list(np.stack((chain[:-1], chain[1:]), axis=1)), closed)], error


def _polygon(element: Element, style: Style, viewport: SvgViewport) -> Shape:
    return _polyline(element, style, viewport, closed=True)


def _quarter(center: Floats, radii: tuple[float, float], begin: float) -> EllipseArc:
    return EllipseArc(center, np.array([radii[0], 0.0]), np.array([0.0, radii[1]]), begin, begin + math.pi / 2)


def _on(arc: EllipseArc, angle: float) -> Floats:
    cos, sin = round(math.cos(angle)), round(math.sin(angle))
    return np.asarray(arc.center + cos * arc.first + sin * arc.second)


SHAPES: dict[str, Callable[[Element, Style, SvgViewport], Shape]] = {
    "path": _path,
    "rect": _rect,
    "circle": _circle,
    "ellipse": _ellipse,
    "line": _line,
    "polyline": _polyline,
    "polygon": _polygon,
}
