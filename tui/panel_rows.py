"""Rows of the side panels: a name, then figures."""

from __future__ import annotations

from textual.content import Content

from touchline.tui import format, theme


def row(name: str, *parts: Content | str | tuple[str, str]) -> Content:
    """Create a row with a name."""
    return Content.assemble((f"{name:<9}", theme.MUTED), *parts)


def bar(fraction: float | None, width: int, color: str) -> Content:
    """Draw a share 0…1 as a bar, with room for its name and its figure in `width` cells."""
    filled, rest = format.bar(fraction, max(width - 18, 6))
    return Content.assemble((filled, color), (rest, theme.TURF_GRID))
