"""SVG drawings as outlines: every shape and path, its transforms carried out, y turned up."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError
from touchline.services.drawings.outline import Edge, FillRule, Floats, Outline, Piece, bezier, ellipse
from touchline.services.drawings.svg_limits import check_svg

ToMetres: TypeAlias = Callable[[Any], tuple[float, float]]

INCH_M = 0.0254
#: Metres of the units of length that have a size in the world; px and % have none.
UNITS_M = {"mm": 0.001, "cm": 0.01, "in": INCH_M, "pt": INCH_M / 72, "pc": INCH_M / 6, "m": 1.0}
#: Relative difference up to which an ellipse is a circle.
ROUND = 1e-9
#: By how much a view box, and a unit in metres, may scale; beyond it numbers have no digits left.
MOST_SCALE = 1e9
#: The name of a layer, as drawing programs write it.
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
#: Elements that show something which is no line.
UNPAINTABLE = {"Text": "convert it to paths", "Image": "trace it"}


def read_svg(path: Path, scale_m: float | None, skip_others: bool) -> tuple[list[Outline], list[str]]:
    """(outlines in metres, names of what was skipped) of an SVG file.

    Args:
        path: The file.
        scale_m: Metres per user unit; None: from the drawing's width or height, if they have a unit of length.
        skip_others: Leave out texts and images instead of refusing them.

    Raises:
        SpecError: It is no SVG, its size in metres is unknown, or an element cannot be painted; it names which.
    """
    check_svg(path)
    try:
        return _read(path, scale_m, skip_others)
    except SpecError:
        raise
    except Exception as error:  # whatever its numbers lead the library into
        raise SpecError(path.name, "", f"is not a readable SVG ({error})", "save it as plain SVG") from error


def _read(path: Path, scale_m: float | None, skip_others: bool) -> tuple[list[Outline], list[str]]:
    import svgelements

    drawing = svgelements.SVG.parse(str(path), reify=True)
    if not isinstance(drawing, svgelements.SVG):  # another kind of XML
        raise SpecError(path.name, "", "has no svg element at its root", "save it as plain SVG")
    to_metres = _to_metres(path.name, drawing, _metres_per_unit(path.name, drawing, scale_m))
    outlines: list[Outline] = []
    skipped: list[str] = []
    seen: dict[str, int] = {}
    for element, layers in _elements(drawing, ()):
        kind = type(element).__name__
        name = _name(element, kind, seen)
        if kind in UNPAINTABLE:
            if not skip_others:
                remedy = f"{UNPAINTABLE[kind]}, or leave it out with --skip-others"
                raise SpecError(path.name, name, "cannot be painted", remedy)
            skipped.append(name)
        elif isinstance(element, svgelements.Shape):
            rule = FillRule.EVEN_ODD if element.values.get("fill-rule") == "evenodd" else FillRule.NONZERO
            found = _outlines(path.name, name, element, to_metres)
            outlines += [replace(outline, rule=rule, layers=layers) for outline in found]
    return outlines, skipped


def _elements(group: Any, layers: tuple[str, ...]) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """All that a group holds, and what is in that, each with the ids and the labels of the groups that it is in."""
    import svgelements

    for element in group:
        yield element, layers
        if isinstance(element, svgelements.Group | svgelements.Use):
            own = element.values.get("attributes", {})
            names = tuple(str(own[key]) for key in ("id", LABEL) if own.get(key))
            yield from _elements(element, layers + names)


def _metres_per_unit(source: str, drawing: Any, scale_m: float | None) -> float:
    if scale_m is not None:
        return scale_m
    box = drawing.viewbox
    for side in ("width", "height"):
        found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-z]+)\s*", str(drawing.values.get(side) or ""))
        if found and found[2] in UNITS_M:
            units = getattr(box, side) if box is not None else None
            return float(found[1]) * UNITS_M[found[2]] / float(units) if units else INCH_M / 96
    raise SpecError(
        source, "svg", "has no width or height in a unit of length", "give the metres of one user unit with --scale"
    )


def _to_metres(source: str, drawing: Any, scale: float) -> ToMetres:
    """From the library's pixels back through the view box to user units, and on to metres with y up."""
    import svgelements

    box = svgelements.Matrix(drawing.viewbox_transform or "")
    smallest, largest = 1 / MOST_SCALE, MOST_SCALE
    if not all(smallest <= abs(factor) <= largest for factor in (scale, box.a, box.d)):
        remedy = f"give it a viewBox that is scaled by {smallest:g} to {largest:g}, or none"
        raise SpecError(source, "viewBox", "cannot be carried to metres", remedy)

    def to_metres(point: Any) -> tuple[float, float]:
        return (scale * (float(point.x) - box.e) / box.a, -scale * (float(point.y) - box.f) / box.d + 0.0)

    return to_metres


def _name(element: Any, kind: str, seen: dict[str, int]) -> str:
    base = re.sub(r"\s+", "-", str(element.id))[:60] if element.id else kind.lower()
    seen[base] = seen.get(base, 0) + 1
    return base if seen[base] == 1 and element.id else f"{base}-{seen[base]}"


def _outlines(source: str, name: str, shape: Any, to_metres: ToMetres) -> Iterator[Outline]:
    import svgelements

    segments = list(svgelements.Path(shape).segments(transformed=True))
    filled = shape.fill is not None and shape.fill.value is not None
    stroked = shape.stroke is not None and shape.stroke.value is not None
    edge = Edge.PAINTED if stroked or not filled else Edge.UNLESS_FILLED
    pieces: list[Piece] = []
    count = 0
    for segment in [*segments, svgelements.Move(end=(0.0, 0.0))]:
        kind = type(segment).__name__
        if kind != "Move":
            pieces += _pieces(source, name, kind, segment, to_metres)
        if kind in ("Move", "Close") and pieces:
            count += 1
            part = name if count == 1 else f"{name}-part-{count}"
            yield Outline(part, tuple(pieces), closed=kind == "Close", filled=filled, edge=edge, area=name)
            pieces = []
    if not count and getattr(shape, "d", None) and len(segments) < 2 and isinstance(shape, svgelements.Path):
        raise SpecError(source, name, "has path data that cannot be read", "mend its d attribute or remove it")


def _pieces(source: str, name: str, kind: str, segment: Any, to_metres: ToMetres) -> list[Piece]:
    def at(point: Any) -> tuple[float, float]:
        x, y = to_metres(point)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise SpecError(source, name, "has a coordinate that is not finite", "mend or remove it")
        return (x, y)

    if kind in ("Line", "Close"):
        start, end = at(segment.start), at(segment.end)
        return [Curve.from_line(start, end)] if math.dist(start, end) > 0.0 else []
    if kind == "QuadraticBezier":
        return [bezier([at(segment.start), at(segment.control), at(segment.end)])]
    if kind == "CubicBezier":
        return [bezier([at(p) for p in (segment.start, segment.control1, segment.control2, segment.end)])]
    begin, center, first, second = (
        np.array(at(point)) for point in (segment.start, segment.center, segment.prx, segment.pry)
    )
    return [_arc(begin, center, first, second, float(segment.sweep))]


def _arc(start: Floats, center: Floats, first_tip: Floats, second_tip: Floats, sweep: float) -> Piece:
    """An elliptical arc, or the exact circular one if both half-diameters are as long and square to each other."""
    p, q = first_tip - center, second_tip - center
    size = float(p @ p)
    if abs(size - float(q @ q)) <= ROUND * size and abs(float(p @ q)) <= ROUND * size:
        turn = math.copysign(1.0, float(p[0] * q[1] - p[1] * q[0]))
        return Curve.from_arc((float(start[0]), float(start[1])), (float(center[0]), float(center[1])), turn * sweep)
    cos, sin = np.linalg.solve(np.column_stack((p, q)), start - center)
    begin = math.atan2(sin, cos)
    return ellipse(center, p, q, begin, begin + sweep)
