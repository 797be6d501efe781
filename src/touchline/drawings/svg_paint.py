"""Visibility of fill and stroke of an SVG shape."""

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from touchline.drawings.svg_document import SvgDocument, href
from touchline.drawings.svg_lengths import SvgViewport, split_length
from touchline.drawings.svg_style import Style, alpha_of, colour_alpha, reference_of

_GRADIENTS = ("linearGradient", "radialGradient")
#: Paints taken from the use element.
CONTEXT = ("context-fill", "context-stroke")
#: Maximum length of a chain of paint servers.
_DEEPEST = 10


@dataclass(frozen=True)
class SvgPaint:
    """Visible paint of a shape.

    Attributes:
        filled, stroked: Whether it has a visible fill, a visible stroke.
        flat_stroked: The same for the stroke of a shape without width or height.
        pattern: Whether a pattern is visible inside.
    """

    filled: bool
    stroked: bool
    flat_stroked: bool
    pattern: bool


def paint_of(style: Style, document: SvgDocument, viewport: SvgViewport) -> SvgPaint:
    """Determine the paint of a shape from its style."""
    values = [in_context(style[name], style) for name in ("fill", "stroke")]
    servers = [_server(value, document) for value in values]
    filled, stroked = (
        _shows(value, server, style, document) and alpha_of(style[opacity]) > 0.0
        for value, server, opacity in zip(values, servers, ("fill-opacity", "stroke-opacity"), strict=True)
    )
    stroked = stroked and viewport.length(style["stroke-width"], "", 1.0) > 0.0
    kinds = ["" if server is None else document.kind(server) for server in servers]
    units = "" if servers[1] is None else servers[1].get("gradientUnits", "objectBoundingBox")
    boxed = kinds[1] in _GRADIENTS and units == "objectBoundingBox"
    flat_stroked = stroked and (not boxed or _shows(values[1], None, style, document))
    pattern = (filled and kinds[0] == "pattern") or (stroked and kinds[1] == "pattern")
    return SvgPaint(filled, stroked, flat_stroked, pattern)


def in_context(value: str, style: Style) -> str:
    """Paint that a copy takes from its use element; none without one."""
    return style.get(f"--{value}", "none") if value in CONTEXT else value


def _server(value: str, document: SvgDocument) -> Element | None:
    reference = reference_of(value)
    target = None if reference is None else document.target(reference[0])
    return target if target is not None and document.kind(target) in (*_GRADIENTS, "pattern") else None


def _shows(value: str, server: Element | None, style: Style, document: SvgDocument) -> bool:
    if server is not None and _paints(server, document):
        return True
    reference = reference_of(value)
    if reference is not None:  # as browsers do, also for a server that paints nothing
        value = reference[1]
    return value not in ("", "none") and bool(colour_alpha(value, style))


def _paints(server: Element, document: SvgDocument) -> bool:
    """True if a gradient has stops, or a pattern tiles, of its own or of the server that it refers to."""
    pattern = document.kind(server) == "pattern"
    if pattern:
        sizes = (split_length(server.get(side)) for side in ("width", "height"))
        if any(size is not None and size[0] <= 0.0 for size in sizes):
            return False
    each: Element | None = server
    for _ in range(_DEEPEST):
        if each is None:
            return False
        if any(pattern or document.kind(child) == "stop" for child in each):
            return True
        each = document.target(href(each))
    return False
