"""SVG shapes as outlines: their visible lines, dashed and clipped, and a list of omissions."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from touchline.drawings.dashes import MOST_DASHES, dashed
from touchline.drawings.omissions import Omission
from touchline.drawings.outline import Edge, FillRule, Floats, Outline
from touchline.drawings.outline_clipping import clipped, encloses_nothing
from touchline.drawings.path_data import SubPath
from touchline.drawings.svg_document import SvgDocument
from touchline.drawings.svg_lengths import SvgViewport
from touchline.drawings.svg_paint import SvgPaint, paint_of
from touchline.drawings.svg_pieces import closed_as_filled, is_flat, is_point, is_within_reach, metric_pieces
from touchline.drawings.svg_shapes import shape_of
from touchline.drawings.svg_style import Style, reference_of

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_NO_NUMBER = "has a coordinate that is not finite, far too large, or a share of a page without a size; mend it"
#: Relative difference of two scales up to which dashes are not stretched.
_SIMILAR = 1e-3


@dataclass(frozen=True)
class SvgPlace:
    """Context in which an element is drawn.

    Attributes:
        matrix: (3, 3) from its user units to metres.
        viewport: Reference of lengths.
        style: Inherited style; once it is known, its own.
        layers: Ids and labels of the enclosing groups.
        regions: Regions that clip it, m.
        used: The elements whose copy it is in.
    """

    matrix: Floats
    viewport: SvgViewport
    style: Style
    layers: tuple[str, ...] = ()
    regions: "tuple[BaseGeometry, ...]" = ()
    used: tuple[Element, ...] = ()

    def then(self, matrix: Floats) -> "SvgPlace":
        """The same place with another matrix before its own."""
        return replace(self, matrix=self.matrix @ matrix)


class SvgPainter:
    """Collects outlines in metres, and what was left out.

    Args:
        document: What is drawn.
        edge: The page, m; None: it has no edge.
        measures: Whether all that has a place counts, visible or not.
    """

    def __init__(self, document: SvgDocument, edge: "BaseGeometry | None", measures: bool = False) -> None:
        self.outlines: list[Outline] = []
        self._document, self._edge, self._measures = document, edge, measures
        self._omissions: dict[Omission, None] = {}
        self._seen: Counter[str] = Counter()

    @property
    def omissions(self) -> list[Omission]:
        """Omissions, each once."""
        return list(self._omissions)

    def omit(self, element: Element, reason: str) -> None:
        """Record an omission."""
        name = re.sub(r"\s+", "-", element.get("id") or self._document.kind(element))[:60]
        self._omissions[Omission(name, reason, self._document.lines[element])] = None

    def paint(self, element: Element, kind: str, place: SvgPlace) -> None:
        """Add the outlines of a shape."""
        style = place.style
        paint = paint_of(style, self._document, place.viewport)
        if not self._measures and not (style["visibility"] == "visible" and (paint.filled or paint.stroked)):
            return
        subpaths, wrong = shape_of(kind, element, style, place.viewport)
        if wrong:
            self.omit(element, wrong)
        outlines = self.drawn(element, self._name(element, kind), subpaths, place)
        if self._measures:
            self.outlines += outlines
            return
        stroked = paint.flat_stroked if is_flat(subpaths) else paint.stroked
        self._note(element, style, paint, subpaths)
        if paint.filled and not stroked:
            shown = [closed_as_filled(each) for each in outlines if not encloses_nothing(each)]
            if outlines and not shown and not paint.stroked:
                self.omit(element, "has no stroke, and its fill encloses nothing; give it a stroke")
            outlines = shown
        elif not stroked:
            return
        edge = Edge.PAINTED if stroked else Edge.UNLESS_FILLED
        rule = FillRule(style["fill-rule"])
        found: list[Outline] = []
        for outline in outlines:
            filled = paint.filled and not encloses_nothing(outline)
            painted = replace(outline, filled=filled, edge=edge, rule=rule, layers=place.layers)
            found += [painted] if filled else self._dashes(element, painted, place)
        for region in place.regions:
            found = clipped(found, region)
        self.outlines += self._on_page(element, found)

    def _on_page(self, element: Element, outlines: list[Outline]) -> list[Outline]:
        if self._edge is None:
            return outlines
        shown = clipped(outlines, self._edge)
        if [each.pieces for each in shown] != [each.pieces for each in outlines]:
            self.omit(element, "reaches beyond the page, and is painted up to its edge; enlarge the page or move it")
        return shown

    def _note(self, element: Element, style: Style, paint: SvgPaint, subpaths: Sequence[SubPath]) -> None:
        """Record parts of a shape that are not painted."""
        if paint.pattern:
            self.omit(element, "has a pattern, of which nothing is painted; draw its lines")
        markers = (reference_of(style[name]) for name in ("marker-start", "marker-mid", "marker-end"))
        found = (self._document.target(marker[0]) for marker in markers if marker is not None)
        if any(marker is not None and self._document.kind(marker) == "marker" for marker in found):
            self.omit(element, "has markers, which are not painted; convert them to paths")
        if paint.stroked and style["stroke-linecap"] != "butt" and any(map(is_point, subpaths)):
            self.omit(element, "has a dot of no length, which is not painted; draw a circle")

    def _dashes(self, element: Element, outline: Outline, place: SvgPlace) -> list[Outline]:
        """Dashes of a line; the line itself, if it has none."""
        words = [word for word in re.split(r"[\s,]+", place.style["stroke-dasharray"]) if word]
        pattern = [place.viewport.length(word, "", -1.0) for word in words]
        if not pattern or min(pattern) < 0.0 or sum(pattern) <= 0.0:
            return [outline]
        pattern = pattern if len(pattern) % 2 == 0 else pattern * 2
        linear = place.matrix[:2, :2]
        scale = math.sqrt(abs(float(np.linalg.det(linear))))
        if np.abs(linear.T @ linear - scale**2 * np.eye(2)).max() > _SIMILAR * scale**2:
            self.omit(element, "has dashes that its transform stretches; convert them to paths")
            return []
        if element.get("pathLength"):
            self.omit(element, "has dashes by pathLength; convert them to paths")
            return []
        offset = place.viewport.length(place.style["stroke-dashoffset"], "", 0.0)
        dashes = dashed(outline, [scale * part for part in pattern], scale * offset)
        if dashes is None:
            self.omit(element, f"has more than {MOST_DASHES:,} dashes; draw it without")
        return dashes or []

    def drawn(self, element: Element, name: str, subpaths: Sequence[SubPath], place: SvgPlace) -> list[Outline]:
        """Outlines of subpaths, in metres."""
        outlines: list[Outline] = []
        for sub in subpaths:
            pieces = [piece for drawn in sub.pieces for piece in metric_pieces(drawn, place.matrix)]
            if not all(map(is_within_reach, pieces)):
                self.omit(element, _NO_NUMBER)
                return []
            if pieces:
                part = name if not outlines else f"{name}-part-{len(outlines) + 1}"
                outlines.append(Outline(part, tuple(pieces), closed=sub.closed, area=name))
        return outlines

    def _name(self, element: Element, kind: str) -> str:
        own = element.get("id")
        base = re.sub(r"\s+", "-", own)[:60] if own else kind.lower()
        self._seen[base] += 1
        return base if self._seen[base] == 1 and own else f"{base}-{self._seen[base]}"
