"""SVG drawings as outlines, as a browser shows them: what is visible, where it is, cut to what clips it; y turned up.

Text, images, masks, markers and other elements that are no lines or cannot be followed exactly are left out.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np
from shapely.errors import ShapelyError

from touchline.drawings.deviation import sampled
from touchline.drawings.omissions import Omission, Unclear
from touchline.drawings.outline import FillRule, Floats, Outline
from touchline.drawings.outline_clipping import region_of
from touchline.drawings.svg_document import SvgDocument, href, parse_svg
from touchline.drawings.svg_lengths import SvgViewport, fitted, view_box
from touchline.drawings.svg_limits import MOST_ELEMENTS, check_svg
from touchline.drawings.svg_page import SvgPage
from touchline.drawings.svg_paint import in_context
from touchline.drawings.svg_painter import SvgPainter, SvgPlace
from touchline.drawings.svg_pieces import (
    parallelogram,
)
from touchline.drawings.svg_shapes import SHAPES, shape_of
from touchline.drawings.svg_style import UNSUPPORTED, Cascade, Style, alpha_of, reference_of
from touchline.drawings.svg_transforms import about, moved, origin_of, parse_transform
from touchline.schemas.errors import SpecError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

#: The name of a layer, as drawing programs write it.
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
#: Elements that show something which is no line.
UNPAINTABLE = {
    "text": "is a text; convert it to paths",
    "image": "is an image; trace it",
    "foreignObject": "holds something that is no SVG; convert it to paths",
    "video": "is a video",
    "audio": "is a sound",
    "canvas": "is a canvas",
    "iframe": "is a page",
}
_GROUPS = frozenset(("g", "a", "svg", "switch"))
_ANIMATIONS = frozenset(("animate", "animateMotion", "animateTransform", "animateColor", "set"))
_SHOWN = frozenset((*_GROUPS, "use", *SHAPES, *UNPAINTABLE))
_LANGUAGE = "en"
#: Exceptions that the libraries raise for numbers of an extreme size.
_STUMBLES = (ArithmeticError, LookupError, TypeError, ValueError, ShapelyError)
#: Samples of a piece for the size of an element.
_MEASURED = 65


def read_svg(path: Path, scale_m: float | None) -> tuple[list[Outline], list[Omission]]:
    """Read an SVG file: outlines in metres, and omissions.

    Args:
        path: Path of the file.
        scale_m: Metres per user unit; None: from the drawing's width or height, if they have a unit of length.

    Raises:
        SpecError: The file is no SVG, its size in metres is unknown, or it exceeds a limit.
    """
    try:
        check_svg(path)
        return _read(path, scale_m)
    except SpecError:
        raise
    except Exception as error:  # whatever its numbers and styles lead the libraries into
        raise SpecError(path.name, "", f"is not a readable SVG ({error})", "save it as plain SVG") from error


def _read(path: Path, scale_m: float | None) -> tuple[list[Outline], list[Omission]]:
    document = parse_svg(path)
    cascade = Cascade(document, path.name)
    style = cascade.computed(document.root, cascade.root(), SvgViewport(100.0, 100.0))
    page = SvgPage.of(path.name, document.root, style, scale_m)
    painter = SvgPainter(document, page.edge)
    if page.visible:
        with np.errstate(all="ignore"):  # what is not finite is left out by name
            _SvgReader(path.name, document, cascade, painter).read(page)
    return painter.outlines, painter.omissions


class _SvgReader:
    """Walk through a document that passes visible shapes to a painter."""

    def __init__(self, source: str, document: SvgDocument, cascade: Cascade, painter: SvgPainter) -> None:
        self._source, self._document, self._cascade, self._painter = source, document, cascade, painter
        self._page: SvgPage | None = None
        self._measures = False
        self._regions: dict[tuple[Element, bytes], BaseGeometry] = {}
        self._clips = 0

    def read(self, page: SvgPage) -> None:
        """Read all that the page shows."""
        root, self._page = self._document.root, page
        for element, reason in self._cascade.unread:
            self._painter.omit(element, reason)
        if self._document.linked_styles:
            self._painter.omit(root, "names a style sheet in another file, which is not read; save it as plain SVG")
        self._element(root, SvgPlace(page.matrix, page.viewport, self._cascade.root()))

    def _element(self, element: Element, place: SvgPlace) -> None:
        kind = self._document.kind(element)
        if kind not in _SHOWN or not _wanted(element):
            return
        style = self._cascade.computed(element, place.style, place.viewport)
        if style["display"] == "none" or (alpha_of(style["opacity"]) == 0.0 and not self._measures):
            return
        place = replace(place, style=style, viewport=replace(place.viewport, font=float(style["font-size"])))
        try:
            place = self._transformed(element, place)
            if not abs(np.linalg.det(place.matrix)) > 0.0:
                return
            if not self._measures:
                self._check_effects(element, style)
                place = self._cut(element, place)
        except Unclear as reason:
            self._painter.omit(element, str(reason))
            return
        except _STUMBLES as error:
            self._painter.omit(element, f"cannot be followed ({error}); redraw or remove it")
            return
        self._content(element, kind, place)

    def _content(self, element: Element, kind: str, place: SvgPlace) -> None:
        if kind in UNPAINTABLE:
            if place.style["visibility"] == "visible":
                self._painter.omit(element, UNPAINTABLE[kind])
            return
        if any(self._document.kind(child) in _ANIMATIONS for child in element):
            self._painter.omit(element, "is animated, and painted as it stands without that")
        if kind in SHAPES:
            try:
                self._painter.paint(element, kind, place)
            except _STUMBLES as error:
                self._painter.omit(element, f"cannot be followed ({error}); redraw or remove it")
            return
        names = tuple(name for name in (element.get("id"), element.get(LABEL)) if name)
        place = replace(place, layers=place.layers + names)
        if kind == "use":
            self._use(element, place)
        elif kind == "svg" and element is not self._document.root:
            self._nested(element, place, (place.style["width"], place.style["height"]))
        else:
            self._children(element, place, kind == "switch")

    def _children(self, element: Element, place: SvgPlace, first: bool = False) -> None:
        for child in element:
            if not first:
                self._element(child, place)
            elif self._document.kind(child) in _SHOWN and _wanted(child):
                self._element(child, place)
                return

    def _use(self, element: Element, place: SvgPlace) -> None:
        reference = href(element)
        target = self._document.target(reference)
        if target is None:
            missing = f"refers to {reference[:60]!r}, which is not there; draw it or remove the element"
            self._painter.omit(
                element, missing if reference.startswith("#") or not reference else "refers to another file; embed it"
            )
            return
        if target in place.used or target is element or target in self._document.ancestors(element):
            self._painter.omit(element, "refers to what it is in; remove it")
            return
        x, y = (place.viewport.length(place.style[axis], axis, 0.0) for axis in "xy")
        context = {f"--context-{name}": in_context(place.style[name], place.style) for name in ("fill", "stroke")}
        place = replace(place.then(moved(x, y)), used=(*place.used, target), style=place.style | context)
        kind = self._document.kind(target)
        if kind not in ("symbol", "svg"):
            self._element(target, place)
            return
        size = (place.style["width"], place.style["height"])
        style = self._cascade.computed(target, place.style, place.viewport)
        if style["display"] != "none" and alpha_of(style["opacity"]) > 0.0:
            self._symbol(target, replace(place, style=style), size)

    def _symbol(self, target: Element, place: SvgPlace, size: tuple[str, str]) -> None:
        """Read a symbol or svg by use; width and height of the use element, if given, replace its own."""
        own = (place.style["width"], place.style["height"])
        size = (_or(size[0], own[0]), _or(size[1], own[1]))
        try:
            place = self._cut(target, self._transformed(target, place))
            self._check_effects(target, place.style)
        except Unclear as reason:
            self._painter.omit(target, str(reason))
            return
        self._nested(target, place, size)

    def _nested(self, element: Element, place: SvgPlace, size: tuple[str, str]) -> None:
        """Read the content of an element with a viewport of its own."""
        style, outer = place.style, place.viewport
        if self._document.kind(element) == "svg":
            place = place.then(moved(outer.length(style["x"], "x", 0.0), outer.length(style["y"], "y", 0.0)))
        width, height = (outer.length(_or(side, "100%"), axis, 0.0) for side, axis in zip(size, "xy", strict=True))
        box = view_box(element.get("viewBox"))
        if math.isnan(width + height):
            self._painter.omit(
                element, "has the size of the page, which has none; give the outermost svg a width and height"
            )
        if not (width > 0.0 and height > 0.0) or (box is not None and min(box[2:]) <= 0.0):
            return
        if style["overflow"] not in ("visible", "auto") and not self._measures:
            corners = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
            place = replace(place, regions=(*place.regions, parallelogram(place.matrix, corners)))
        if box is not None:
            place = place.then(fitted(box, (width, height), element.get("preserveAspectRatio")))
        inner = (width, height) if box is None else box[2:]
        self._children(element, replace(place, viewport=replace(place.viewport, width=inner[0], height=inner[1])))

    def _transformed(self, element: Element, place: SvgPlace) -> SvgPlace:
        value, origin = place.style["transform"], place.style["transform-origin"]
        if any(place.style.get(name, "none") not in ("none", "auto") for name in UNSUPPORTED):
            raise Unclear("is moved by a CSS property other than transform; use transform")
        if value == "none":
            return place
        viewport = place.viewport
        corner = np.zeros(2)
        if place.style["transform-box"] not in ("view-box", "") and origin:
            low, high = self._box(element, place)
            corner, (width, height) = low, (high - low).tolist()
            viewport = replace(viewport, width=width, height=height)
        root = element is self._document.root and self._page is not None
        if root and self._page is not None:
            viewport, origin = replace(viewport, width=viewport.page[0], height=viewport.page[1]), origin or "50% 50%"
        matrix = parse_transform(value, True, viewport)
        if matrix is None:
            matrix = parse_transform(value, False, viewport)
        about_point = origin_of(origin, viewport)
        if matrix is None:
            return place
        if about_point is not None:
            matrix = about(matrix, corner + about_point)
        if root and self._page is not None:
            matrix = np.linalg.inv(self._page.fit) @ matrix @ self._page.fit
        return place.then(matrix)

    def _check_effects(self, element: Element, style: Style) -> None:
        """Refuse an element with effects that change its appearance."""
        for name, remedy in (("mask", "cut the shape itself"), ("filter", "remove it")):
            if style[name] in ("none", ""):
                continue
            reference = reference_of(style[name])
            target = None if reference is None else self._document.target(reference[0])
            if (
                reference is None
                or not reference[0].startswith("#")
                or (target is not None and self._document.kind(target) == name)
            ):
                raise Unclear(f"has a {name}, which cannot be followed; {remedy}")

    def _cut(self, element: Element, place: SvgPlace) -> SvgPlace:
        """Add the region of the element's clip path to a place."""
        value = place.style["clip-path"]
        if value == "none":
            return place
        reference = reference_of(value)
        if reference is None or not reference[0].startswith("#"):
            raise Unclear("is clipped by what is no clipPath of the file; cut the shape itself")
        clip = self._document.target(reference[0])
        if clip is None or self._document.kind(clip) != "clipPath":
            return place
        return replace(place, regions=(*place.regions, self._region(clip, element, place, ())))

    def _region(
        self,
        clip: Element,
        element: Element,
        place: SvgPlace,
        chain: tuple[Element, ...],
    ) -> "BaseGeometry":
        """Region of a clipPath for an element at a place, m."""
        import shapely

        if clip in chain:
            raise Unclear("is clipped by a clipPath that refers to itself")
        style = self._style_of(clip)
        inner = self._transformed(clip, replace(place, style=style))
        if clip.get("clipPathUnits") == "objectBoundingBox":
            low, high = self._box(element, place)
            width, height = (high - low).tolist()
            inner = inner.then(np.array([[width, 0.0, low[0]], [0.0, height, low[1]], [0.0, 0.0, 1.0]]))
        key = (clip, inner.matrix.tobytes())
        if not abs(np.linalg.det(inner.matrix)) > 0.0:
            self._regions[key] = shapely.Polygon()
        if key not in self._regions:
            parts = [self._clip_part(child, inner, (*chain, clip)) for child in clip]
            self._regions[key] = shapely.union_all([part for part in parts if part is not None])
        region = self._regions[key]
        return self._within(region, clip, element, replace(place, style=style), (*chain, clip))

    def _within(
        self,
        region: "BaseGeometry",
        owner: Element,
        element: Element,
        place: SvgPlace,
        chain: tuple[Element, ...],
    ) -> "BaseGeometry":
        """Clip a region by its owner's own clip path."""
        reference = reference_of(place.style["clip-path"])
        clip = None if reference is None else self._document.target(reference[0])
        if clip is None or self._document.kind(clip) != "clipPath":
            return region
        return region.intersection(self._region(clip, element, place, chain))

    def _clip_part(self, child: Element, place: SvgPlace, chain: tuple[Element, ...]) -> "BaseGeometry | None":
        """Region of one child of a clipPath."""
        self._clips += 1
        if self._clips > MOST_ELEMENTS:
            raise SpecError(self._source, "clipPath", f"is made of more than {MOST_ELEMENTS:,} shapes", "simplify it")
        kind = self._document.kind(child)
        if kind not in _SHOWN or not _wanted(child):
            return None
        style = self._cascade.computed(child, place.style, place.viewport)
        if style["display"] == "none":
            return None
        place = self._transformed(child, replace(place, style=style))
        shape = child
        if kind == "use" and (used := self._document.target(href(child))) is not None:
            x, y = (place.viewport.length(style[axis], axis, 0.0) for axis in "xy")
            style = self._cascade.computed(used, style, place.viewport)
            place = self._transformed(used, replace(place.then(moved(x, y)), style=style))
            shape, kind = used, self._document.kind(used)
        if style["visibility"] != "visible" or style["display"] == "none":
            return None
        if kind in UNPAINTABLE:
            raise Unclear(f"is clipped by a {kind}; cut the shape itself")
        if kind not in SHAPES:
            return None
        if not abs(np.linalg.det(place.matrix)) > 0.0:
            return None
        subpaths, _ = shape_of(kind, shape, style, place.viewport)
        outlines = self._painter.drawn(shape, kind, subpaths, place)
        rule = FillRule(style["clip-rule"])
        region = region_of([replace(each, rule=rule) for each in outlines])
        return self._within(region, child, shape, place, chain)

    def _style_of(self, element: Element) -> Style:
        """Computed style of an element."""
        style = self._cascade.root()
        for each in (*self._document.ancestors(element), element):
            style = self._cascade.computed(each, style, SvgViewport(100.0, 100.0))
        return style

    def _box(self, element: Element, place: SvgPlace) -> tuple[Floats, Floats]:
        """Bounding box of an element's content, lowest and highest (x, y), in its own user units."""
        painter = SvgPainter(self._document, None, measures=True)
        reader = _SvgReader(self._source, self._document, self._cascade, painter)
        reader._measures = True
        kind = self._document.kind(element)
        reader._content(element, kind, replace(place, matrix=np.eye(3), regions=()))
        if any(omission.reason in UNPAINTABLE.values() for omission in painter.omissions):
            raise Unclear("depends on the size of what is no line; cut the shape itself")
        points = [sampled(piece, _MEASURED) for outline in painter.outlines for piece in outline.pieces]
        if not points:
            raise Unclear("depends on the size of nothing; cut the shape itself")
        every = np.concatenate(points)
        return every.min(axis=0), every.max(axis=0)


def _wanted(element: Element) -> bool:
    """True if the conditional attributes of an element hold: no extensions, and a matching language."""
    languages = element.get("systemLanguage")
    if languages is not None:
        tags = [tag.strip().lower() for tag in languages.split(",")]
        if not any(tag == _LANGUAGE or tag.startswith(f"{_LANGUAGE}-") for tag in tags):
            return False
    return element.get("requiredExtensions") is None


def _or(value: str, other: str) -> str:
    return other if value in ("", "auto") else value
