"""Greyscale filter for NO_COLOR."""

from __future__ import annotations

from rich.segment import Segment
from textual.color import Color
from textual.filter import Monochrome, monochrome_style


class Grey(Monochrome):
    """Textual's filter for `NO_COLOR`, shades of grey, but for text without a style, at which it fails."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The same segments, in grey."""
        return [Segment(text, style and monochrome_style(style), control) for text, style, control in segments]
