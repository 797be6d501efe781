"""Style of SVG elements by CSS: presentation attributes, style sheets, style attributes and inheritance."""

import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element

from touchline.drawings.svg_document import SvgDocument
from touchline.drawings.svg_lengths import SvgViewport, is_length, split_length
from touchline.drawings.svg_transforms import parse_transform
from touchline.schemas.errors import SpecError

#: Computed values by property, custom properties included.
Style: TypeAlias = dict[str, str]

#: Inherited properties, and their initial values.
INHERITED = {
    "clip-rule": "nonzero",
    "color": "black",
    "fill": "black",
    "fill-opacity": "1",
    "fill-rule": "nonzero",
    "font-size": "16",
    "marker-end": "none",
    "marker-mid": "none",
    "marker-start": "none",
    "stroke": "none",
    "stroke-dasharray": "none",
    "stroke-dashoffset": "0",
    "stroke-linecap": "butt",
    "stroke-opacity": "1",
    "stroke-width": "1",
    "visibility": "visible",
}
#: Properties that are not inherited; "": the default of the element's kind.
OWN = {
    "clip-path": "none",
    "display": "inline",
    "filter": "none",
    "mask": "none",
    "opacity": "1",
    "overflow": "",
    "transform": "none",
    "transform-box": "view-box",
    "transform-origin": "",
    **dict.fromkeys(("x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "d"), ""),
}
#: Kinds of elements that have these properties as attributes.
_ATTRIBUTES = {
    **dict.fromkeys(("x", "y", "width", "height"), frozenset(("svg", "rect", "use", "symbol"))),
    **dict.fromkeys(("cx", "cy"), frozenset(("circle", "ellipse"))),
    **dict.fromkeys(("rx", "ry"), frozenset(("rect", "ellipse"))),
    "r": frozenset(("circle",)),
    "d": frozenset(("path",)),
}
#: Properties that move a shape and are not supported; they have no attribute.
UNSUPPORTED = ("translate", "rotate", "scale", "offset-path", "offset")
_SHORTHANDS = {"marker": ("marker-start", "marker-mid", "marker-end"), "mask-image": ("mask",)}
_LENGTHS = frozenset(("x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "stroke-width", "stroke-dashoffset"))
_UNITLESS = frozenset(("stroke-width", "stroke-dashoffset"))
_OPACITIES = frozenset(("opacity", "fill-opacity", "stroke-opacity"))
_CHOICES = {
    "visibility": ("visible", "hidden", "collapse"),
    "clip-rule": ("nonzero", "evenodd"),
    "fill-rule": ("nonzero", "evenodd"),
    "stroke-linecap": ("butt", "round", "square"),
    "overflow": ("visible", "hidden", "scroll", "auto", "clip"),
    "transform-box": ("view-box", "fill-box", "stroke-box", "content-box", "border-box"),
}
_DISPLAYS = re.compile(
    r"none|contents|block|inline(-\w+)?|flex|grid|list-item|flow-root|run-in|table(-\w+)*|compact|marker"
)
_URL = re.compile(r"url\(\s*(['\"]?)(.*?)\1\s*\)\s*(.*)", re.DOTALL)
_VAR = re.compile(r"var\(\s*(--[\w-]+)\s*(?:,((?:[^()]|\([^()]*\))*))?\)")
_WIDE = ("inherit", "initial", "unset", "revert", "revert-layer")
#: Maximum number of rules of style sheets times elements.
MOST_MATCHES = 5_000_000
#: Maximum number of custom properties in one value.
_MOST_VARS = 20


def reference_of(value: str) -> tuple[str, str] | None:
    """Parse url(#id) … to ("#id", rest); None if the value is no such reference."""
    found = _URL.fullmatch(value.strip())
    return (found[2], found[3].strip()) if found else None


def alpha_of(value: str) -> float:
    """Parse an opacity, 0 to 1."""
    found = split_length(value)
    number = 1.0 if found is None else found[0] / (100 if found[1] == "%" else 1)
    return min(max(number, 0.0), 1.0)


def colour_alpha(value: str, style: Style) -> float | None:
    """Opacity of a colour; None if the value is no colour."""
    from tinycss2.color4 import parse_color

    colour = parse_color(value)
    if colour is None and " icc-color" in value:
        colour = parse_color(value.partition(" icc-color")[0])
    if colour == "currentcolor":
        own = style.get("color", "black")
        return 1.0 if own.lower() == "currentcolor" else colour_alpha(own, style)
    return None if colour is None else float(colour.alpha)


class Cascade:
    """Specified values of each element of a document, and computed values from those."""

    def __init__(self, document: SvgDocument, source: str) -> None:
        self.unread: list[tuple[Element, str]] = []
        self._document, self._source = document, source
        self._sheets: dict[Element, list[Any]] = defaultdict(list)
        self._match()

    def root(self) -> Style:
        """Initial style, which the document's root inherits."""
        return dict(INHERITED)

    def computed(self, element: Element, parent: Style, viewport: SvgViewport) -> Style:
        """Computed values of an element."""
        specified = self._specified(element, viewport)
        style = {name: parent[name] for name in parent if name in INHERITED or name.startswith("--")} | OWN
        custom = {name: value for name, value in specified.items() if name.startswith("--")}
        style |= custom
        for name, written in specified.items():
            if name not in custom:
                style[name] = _resolved(name, _substituted(written, style), parent)
        style["font-size"] = str(_font(style["font-size"], float(parent["font-size"])))
        return style

    def _specified(self, element: Element, viewport: SvgViewport) -> dict[str, str]:
        """Specified values by property; the strongest declaration wins."""
        values: dict[str, str] = {}
        kind = self._document.kind(element)
        for name, value in element.attrib.items():
            known = (name in INHERITED or name in OWN) and kind in _ATTRIBUTES.get(name, (kind,))
            if known and _valid(name, value.strip(), False, viewport):
                values[name] = value.strip()
        inline = _declarations(element.get("style", ""))
        sheets = self._sheets.get(element, [])
        for important in (False, True):
            for declaration in [*sheets, *inline]:
                if declaration.important == important:
                    values |= _expanded(declaration, viewport)
        return values

    def _match(self) -> None:
        import cssselect2

        matcher, count = cssselect2.Matcher(), 0
        for style in self._document.root.iter():
            if self._document.kind(style) != "style" or style.get("type", "text/css").strip() not in ("", "text/css"):
                continue
            for prelude, declarations in self._rules(style):
                try:
                    selectors = cssselect2.compile_selector_list(prelude)
                except cssselect2.SelectorError:
                    continue  # as in a browser
                for selector in selectors:
                    if selector.pseudo_element is None:
                        matcher.add_selector(selector, declarations)
                        count += 1
        if not count:
            return
        if count * len(self._document.lines) > MOST_MATCHES:
            remedy = "save it as plain SVG"
            raise SpecError(
                self._source, "style", f"has {count:,} rules for {len(self._document.lines):,} elements", remedy
            )
        for wrapper in cssselect2.ElementWrapper.from_xml_root(self._document.root).iter_subtree():
            for *_, declarations in matcher.match(wrapper):
                self._sheets[wrapper.etree_element] += declarations

    def _rules(self, style: Element) -> Iterator[tuple[Any, list[Any]]]:
        """Generate (selector, declarations) of each rule for screens; unread rules are recorded."""
        import tinycss2

        if not _on_screen(style.get("media", "")):
            return
        text = "".join(style.itertext())
        todo = list(tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True))
        while todo:
            rule = todo.pop(0)
            if rule.type == "qualified-rule":
                yield rule.prelude, _declarations(rule.content)
            elif rule.type == "at-rule" and rule.lower_at_keyword == "media" and rule.content is not None:
                if _on_screen(tinycss2.serialize(rule.prelude)):
                    todo[:0] = tinycss2.parse_rule_list(rule.content, skip_comments=True, skip_whitespace=True)
            elif rule.type == "at-rule" and rule.lower_at_keyword in ("import", "supports", "layer", "container"):
                self.unread.append((style, f"its @{rule.lower_at_keyword} is not read; save it as plain SVG"))


def _on_screen(query: str) -> bool:
    """True if a media query holds on a screen; queries about sizes do not."""
    words = (part.strip().lower().removeprefix("only ") for part in query.split(","))
    return any(word in ("", "all", "screen") for word in words)


def _declarations(content: Any) -> list[Any]:
    import tinycss2

    parse = tinycss2.parse_blocks_contents
    return [each for each in parse(content, skip_comments=True, skip_whitespace=True) if each.type == "declaration"]


def _expanded(declaration: Any, viewport: SvgViewport) -> dict[str, str]:
    import tinycss2

    name = declaration.name if declaration.name.startswith("--") else declaration.lower_name
    value = tinycss2.serialize(declaration.value).strip()
    if not _valid(name, value, True, viewport):
        return {}
    return dict.fromkeys(_SHORTHANDS.get(name, (name,)), value)


def _resolved(name: str, value: str, parent: Style) -> str:
    """Resolve a value that refers to another one, such as `inherit`."""
    if value not in _WIDE:
        return value
    if value == "inherit" or (value != "initial" and name in INHERITED):
        return parent.get(name, OWN.get(name, ""))
    return (INHERITED | OWN).get(name, "")


def _substituted(value: str, style: Style) -> str:
    """Substitute the custom properties in a value; "unset" if one is missing."""
    for _ in range(_MOST_VARS):
        if "var(" not in value:
            return value
        found = _VAR.search(value)
        other = None if found is None else style.get(found[1], found[2])
        if found is None or other is None:
            break
        value = value[: found.start()] + other.strip() + value[found.end() :]
    return "unset"


def _font(value: str, parent: float) -> float:
    found = split_length(value)
    if found is None or found[0] < 0.0:
        return parent
    number, unit = found
    return number / 100 * parent if unit == "%" else SvgViewport(0.0, 0.0, parent).length(value, "", parent)


def _valid(name: str, value: str, css: bool, viewport: SvgViewport) -> bool:
    """True if a value is valid for a property; invalid ones are ignored."""
    if name.startswith("--") or value in _WIDE or "var(" in value:
        return True
    if name in ("fill", "stroke"):
        return _is_paint(value)
    if name == "color":
        return colour_alpha(value, {}) is not None
    if name in _CHOICES:
        return value in _CHOICES[name]
    if name == "display":
        return _DISPLAYS.fullmatch(value) is not None
    if name in _OPACITIES:
        return split_length(value) is not None
    if name == "transform":
        return value == "none" or parse_transform(value, css, viewport) is not None
    if name in _LENGTHS:
        return value == "auto" or is_length(value, css and name not in _UNITLESS) or "calc(" in value
    return True


def _is_paint(value: str) -> bool:
    if value in ("none", "context-fill", "context-stroke"):
        return True
    reference = reference_of(value)
    if reference is not None:
        return reference[1] in ("", "none") or colour_alpha(reference[1], {}) is not None
    return colour_alpha(value, {}) is not None
