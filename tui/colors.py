"""Filters for terminals with few colours: greyscale for NO_COLOR, and a palette for 16 colours."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

from rich.color import Color as RichColor
from rich.segment import Segment
from rich.style import Style
from textual.app import App
from textual.color import Color
from textual.filter import LineFilter, Monochrome, monochrome_style

from touchline.tui import theme

SIXTEEN: Final = {
    theme.BLACK: 0,
    theme.SURFACE: 0,
    theme.PANEL: 0,
    theme.STOPPED_PANEL: 0,
    theme.TURF: 0,
    theme.TURF_STRIPE: 0,
    theme.TURF_GRID: 8,
    theme.INK: 7,
    theme.MUTED: 7,
    theme.FAINT: 7,
    theme.LABEL: 7,
    theme.WHITE: 15,
    theme.TO_PAINT: 2,
    theme.GREEN: 2,
    theme.YELLOW: 11,
    theme.ORANGE: 11,
    theme.PATH: 12,
    theme.SKY: 14,
    theme.PURPLE: 13,
    theme.VERMILION: 9,
    theme.STOP: 1,
}
"""Colour of the theme → its number on a terminal with 16. The nearest one, which Rich would take, is often taken:
painted and unpainted lines would both be white, and the emergency stop olive."""
_BY_RGB: Final = {RichColor.parse(color).triplet: number for color, number in SIXTEEN.items()}


def has_colors(app: App[Any]) -> bool:
    """True if the terminal shows colours, and NO_COLOR does not forbid them."""
    return not app.no_color and (app.is_headless or app.console.color_system is not None)


def has_sixteen_colors(app: App[Any]) -> bool:
    """True if the terminal shows 16 colours only; false without a terminal."""
    return has_colors(app) and not app.is_headless and app.console.color_system == "standard"


class Grey(Monochrome):
    """Textual's filter for `NO_COLOR`, shades of grey, without its failure at text without a style."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Convert segments to grey."""
        return [Segment(text, style and monochrome_style(style), control) for text, style, control in segments]


class Sixteen(LineFilter):
    """Filter that maps colours of the theme to their numbers; Rich maps others, such as dimmed ones."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Convert segments to the 16 colours."""
        return [Segment(text, style and sixteen_style(style), control) for text, style, control in segments]


@lru_cache(4096)
def sixteen_style(style: Style) -> Style:
    """Convert a style to the 16 colours."""
    return style + Style(color=_numbered(style.color), bgcolor=_numbered(style.bgcolor))


def _numbered(color: RichColor | None) -> RichColor | None:
    number = _BY_RGB.get(color.triplet) if color is not None and color.triplet is not None else None
    return None if number is None else RichColor.from_ansi(number)
