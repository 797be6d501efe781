"""SVG transforms, of the attribute and of the CSS property, as matrices (3, 3)."""

import math
import re
from collections.abc import Callable

import numpy as np

from touchline.drawings.outline import Floats
from touchline.drawings.svg_lengths import SvgViewport, is_length, split_length

_FUNCTION = re.compile(r"[\s,]*([a-zA-Z0-9]+)\s*\(([^()]*)\)")
_ANGLES = {"deg": 1.0, "grad": 0.9, "rad": 180 / math.pi, "turn": 360.0}
#: Arguments of a CSS function (x, y a length along that axis, n a number, a an angle), and how many are required.
_TAKES = {
    "matrix": ("nnnnnn", 6), "translate": ("xy", 1), "translateX": ("x", 1), "translateY": ("y", 1),
    "scale": ("nn", 1), "scaleX": ("n", 1), "scaleY": ("n", 1), "rotate": ("a", 1), "skew": ("aa", 1),
    "skewX": ("a", 1), "skewY": ("a", 1),
}  # fmt: skip
_SIDES = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}


def parse_transform(text: str, css: bool, viewport: SvgViewport) -> Floats | None:
    """Matrix of a list of transforms; None if it is not valid, or not in the plane.

    Args:
        text: Transforms as written.
        css: Whether lengths and angles must have units.
        viewport: Reference of lengths.
    """
    matrix, position = np.eye(3), 0
    if text.strip() in ("", "none"):
        return matrix
    while found := _FUNCTION.match(text, position):
        one = _function(found[1], found[2], css, viewport)
        if one is None:
            return None
        matrix = matrix @ one
        position = found.end()
    return None if text[position:].strip() else matrix


def origin_of(text: str, viewport: SvgViewport) -> Floats | None:
    """Transform-origin (2,) from the corner of the viewport's box; None if it is not valid."""
    words = text.split()[:2]
    if not words:
        return None
    if words[0] in ("top", "bottom") or (len(words) > 1 and words[1] in ("left", "right")):
        words = [words[1] if len(words) > 1 else "center", words[0]]
    words = [_SIDES.get(word, word) for word in [*words, "center"][:2]]
    if not all(map(is_length, words)):
        return None
    return np.array([viewport.length(words[0], "x", 0.0), viewport.length(words[1], "y", 0.0)])


def about(matrix: Floats, origin: Floats) -> Floats:
    """Move a transform to another origin (2,)."""
    return moved(*origin) @ matrix @ moved(*-origin)


def moved(x: float, y: float) -> Floats:
    """Translation by (x, y)."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def _function(name: str, text: str, css: bool, viewport: SvgViewport) -> Floats | None:
    words = [word for word in re.split(r"[\s,]+", text.strip()) if word]
    if not css and name == "rotate" and len(words) == 3:
        numbers = [_value(word, "n", False, viewport) for word in words]
        if any(number is None for number in numbers):
            return None
        angle, x, y = (number or 0.0 for number in numbers)
        return about(_rotated(angle), np.array([x, y]))
    if name not in _TAKES or (not css and name in ("translateX", "translateY", "scaleX", "scaleY", "skew")):
        return None
    kinds, least = _TAKES[name]
    if not least <= len(words) <= len(kinds):
        return None
    values = [_value(word, kind, css, viewport) for word, kind in zip(words, kinds, strict=False)]
    return None if any(value is None for value in values) else _MATRICES[name](*(value or 0.0 for value in values))


def _value(word: str, kind: str, css: bool, viewport: SvgViewport) -> float | None:
    found = split_length(word)
    if found is None:
        return None
    number, unit = found
    if kind == "n":
        return number if unit == "" else None
    if kind == "a":
        if unit == "":
            return number if not css or number == 0.0 else None
        return number * _ANGLES[unit] if unit in _ANGLES else None
    return viewport.length(word, kind, 0.0) if is_length(word, css) else None


def _rotated(degrees: float) -> Floats:
    cos, sin = (round(f, 15) for f in (math.cos(math.radians(degrees)), math.sin(math.radians(degrees))))
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _linear(a: float, b: float, c: float, d: float, e: float = 0.0, f: float = 0.0) -> Floats:
    return np.array([[a, c, e], [b, d, f], [0.0, 0.0, 1.0]])


def _tan(degrees: float) -> float:
    return math.tan(math.radians(degrees))


_MATRICES: dict[str, Callable[..., Floats]] = {
    "matrix": _linear,
    "translate": lambda x, y=0.0: moved(x, y),
    "translateX": lambda x: moved(x, 0.0),
    "translateY": lambda y: moved(0.0, y),
    "scale": lambda x, y=None: _linear(x, 0.0, 0.0, x if y is None else y),
    "scaleX": lambda x: _linear(x, 0.0, 0.0, 1.0),
    "scaleY": lambda y: _linear(1.0, 0.0, 0.0, y),
    "rotate": _rotated,
    "skew": lambda x, y=0.0: _linear(1.0, _tan(y), _tan(x), 1.0),
    "skewX": lambda x: _linear(1.0, 0.0, _tan(x), 1.0),
    "skewY": lambda y: _linear(1.0, _tan(y), 0.0, 1.0),
}
