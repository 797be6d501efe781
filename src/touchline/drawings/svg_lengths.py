"""SVG lengths and viewports: units, percentages, viewBox and preserveAspectRatio."""

import math
import re
from dataclasses import dataclass

import numpy as np

from touchline.drawings.outline import Floats

INCH_M = 0.0254
PX_M = INCH_M / 96
#: Metres of the physical units; "m" is not in CSS, but unambiguous.
UNITS_M = {"mm": 0.001, "cm": 0.01, "q": 0.00025, "in": INCH_M, "pt": INCH_M / 72, "pc": INCH_M / 6, "m": 1.0}
_LENGTH = re.compile(r"\s*([+-]?(?:[0-9]*\.[0-9]+|[0-9]+\.?)(?:[eE][+-]?[0-9]+)?)\s*(%|[a-zA-Z]*)\s*")
_NUMBERS = re.compile(r"[\s,]+")
_ALIGN = re.compile(r"\s*(?:defer\s+)?(none|x(Min|Mid|Max)Y(Min|Mid|Max))(?:\s+(meet|slice))?\s*")
_SHARE = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}


def split_length(text: str | None) -> tuple[float, str] | None:
    """Split a length into number and lower-case unit; None if it is no length."""
    found = _LENGTH.fullmatch(text or "")
    return (float(found[1]), found[2].lower()) if found else None


def is_length(text: str, css: bool = False) -> bool:
    """True if a text is a length; in CSS only 0 may lack a unit."""
    found = split_length(text)
    if found is None:
        return False
    number, unit = found
    known = unit in UNITS_M or unit in ("px", "%", "em", "rem", "ex", "ch", "vw", "vh", "vmin", "vmax")
    return known or (unit == "" and (not css or number == 0.0))


@dataclass(frozen=True)
class SvgViewport:
    """Reference sizes of lengths, in user units (px).

    Attributes:
        width, height: Size of the nearest viewport.
        font: Font size.
        page: Width and height of the page.
    """

    width: float
    height: float
    font: float = 16.0
    page: tuple[float, float] = (100.0, 100.0)

    def length(self, text: str | None, along: str, default: float) -> float:
        """Convert a length to user units.

        Args:
            text: Length as written; anything else gives the default.
            along: Reference of percentages: "x", "y" or "" for the diagonal.
            default: Default in user units.
        """
        found = split_length(text)
        if found is None:
            return default
        number, unit = found
        if unit == "%":
            whole = {"x": self.width, "y": self.height}.get(along, math.hypot(self.width, self.height) / math.sqrt(2))
            return number / 100 * whole
        sizes = {"": 1.0, "px": 1.0, "em": self.font, "rem": 16.0, "ex": self.font / 2, "ch": self.font / 2}
        sizes |= {"vw": self.page[0] / 100, "vh": self.page[1] / 100}
        sizes |= {"vmin": min(self.page) / 100, "vmax": max(self.page) / 100}
        sizes |= {name: metres / PX_M for name, metres in UNITS_M.items()}
        return number * sizes[unit] if unit in sizes else default


def view_box(text: str | None) -> tuple[float, float, float, float] | None:
    """Parse a viewBox to (x, y, width, height); None if it is missing or not valid."""
    parts = [split_length(part) for part in _NUMBERS.split((text or "").strip())]
    numbers = [part[0] for part in parts if part is not None and part[1] == ""]
    if len(numbers) != 4 or len(parts) != 4 or min(numbers[2:]) < 0.0:
        return None
    x, y, width, height = numbers
    return x, y, width, height


def fitted(box: tuple[float, float, float, float], size: tuple[float, float], aspect: str | None) -> Floats:
    """Matrix (3, 3) that maps a view box to a viewport (0, 0, width, height), by preserveAspectRatio."""
    x, y, width, height = box
    scale = np.array([size[0] / width, size[1] / height])
    found = _ALIGN.fullmatch(aspect or "") or _ALIGN.fullmatch("xMidYMid meet")
    assert found is not None
    rest = np.zeros(2)
    if found[1] != "none":
        scale[:] = scale.max() if found[4] == "slice" else scale.min()
        rest = np.array([_SHARE[found[2]], _SHARE[found[3]]]) * (size - scale * (width, height))
    move = rest - scale * (x, y)
    return np.array([[scale[0], 0.0, move[0]], [0.0, scale[1], move[1]], [0.0, 0.0, 1.0]])
