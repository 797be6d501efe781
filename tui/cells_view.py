"""Widget that shows an array of characters and inks, and redraws only the rows of it that changed."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from touchline.tui import theme
from touchline.tui.colors import has_colors
from touchline.tui.map_raster import Cells, Ink
from touchline.tui.mono_cells import STYLES, in_shapes
from touchline.tui.viewport import Viewport

ZOOM_STEP = 1.4
COLORS = {
    Ink.GROUND: (theme.TURF_GRID, ""),
    Ink.GRID: (theme.TURF_GRID, ""),
    Ink.PATH: (theme.PATH, ""),
    Ink.CURRENT_PATH: (theme.SKY, ""),
    Ink.TEMPLATE: (theme.TO_PAINT, ""),
    Ink.CURRENT: (theme.YELLOW, ""),
    Ink.LIMIT: (theme.PURPLE, ""),
    Ink.PAINT: (theme.WHITE, "bold"),
    Ink.MISSED: (theme.VERMILION, "bold"),
    Ink.SLOW_ZONE: (theme.ORANGE, ""),
    Ink.STOP_ZONE: (theme.ORANGE, ""),
    Ink.SEEN: (theme.VERMILION, ""),
    Ink.BODY: (theme.ORANGE, "bold"),
    Ink.LABEL: (theme.LABEL, ""),
    Ink.OBSTACLE: (f"{theme.BLACK} on {theme.VERMILION}", "bold"),
    Ink.ABSENT: (f"{theme.BLACK} on {theme.PURPLE}", "bold"),
    Ink.OTHER: (f"{theme.BLACK} on {theme.MUTED}", "bold"),
    Ink.OTHER_STOPPED: (f"{theme.WHITE} on {theme.STOP}", "bold"),
    Ink.NOZZLE_OFF: (theme.ORANGE, "bold"),
    Ink.NOZZLE_ON: (theme.YELLOW, "bold"),
    Ink.GOAL: (f"{theme.BLACK} on {theme.SKY}", "bold"),
    Ink.ROBOT: (f"{theme.BLACK} on {theme.ORANGE}", "bold"),
    Ink.ROBOT_STOPPED: (f"{theme.WHITE} on {theme.STOP}", "bold"),
    Ink.UNHEARD: (f"{theme.BLACK} on {theme.YELLOW}", "bold"),
    Ink.GONE: (f"{theme.WHITE} on {theme.STOP}", "bold"),
}


def cell_styles(changed: Mapping[Ink, tuple[str, str]]) -> list[Style]:
    """Create styles by 2·ink + stripe; `changed` replaces the (colour, attributes) of some inks."""
    styles, colors = [], {**COLORS, **changed}
    for ink in Ink:
        color, attributes = colors[ink]
        for turf in (theme.TURF, theme.TURF_STRIPE):
            ground = "" if " on " in color else f" on {turf}"
            styles.append(Style.parse(f"{attributes} {color}{ground}".strip()))
    return styles


class CellsView(Widget):
    """A window on the field, drawn into cells.

    Attributes:
        view: Viewport of the field.
        cells: Cells on the screen; None before the first drawing.
        shapes: Whether shapes replace colours, on terminals without any.
    """

    def __init__(self) -> None:
        """Create an empty view."""
        super().__init__()
        self.view = Viewport(1, 1, dot_m=0.5)
        self.cells: Cells | None = None
        self.shapes = False
        self._keys = np.zeros((0, 0), dtype=np.uint64)
        self._strips: dict[int, Strip] = {}
        self._styles = cell_styles({})

    def on_mount(self) -> None:
        """Adapt to the terminal's colours."""
        self.shapes = not has_colors(self.app)
        if self.shapes:
            self.restyle(cell_styles(STYLES))

    @abstractmethod
    def compose_cells(self) -> Cells:
        """Draw the cells of `view`."""

    @abstractmethod
    def zoom(self, steps: float, column: float | None = None, row: float | None = None) -> None:
        """Zoom in by steps, about a cell or the middle."""

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Zoom in at the pointer."""
        self._wheel(event, 1)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Zoom out at the pointer."""
        self._wheel(event, -1)

    def _wheel(self, event: events.MouseEvent, steps: float) -> None:
        event.stop()
        offset = event.get_content_offset(self)
        if offset is not None:
            self.zoom(steps, offset.x + 0.5, offset.y + 0.5)

    def restyle(self, styles: list[Style]) -> None:
        """Change the colours."""
        self._styles = styles
        self._strips.clear()
        self.refresh()

    def redraw(self) -> None:
        """Redraw, and show what changed."""
        cells = self.compose_cells()
        if self.shapes:
            cells = in_shapes(cells)
        keys = (cells.codes.astype(np.uint64) << np.uint64(16)) | (cells.inks.astype(np.uint64) << np.uint64(1))
        keys |= cells.stripe.astype(np.uint64)
        self.cells = cells
        if keys.shape != self._keys.shape:
            self._strips.clear()
            self.refresh()
        else:
            for row in np.flatnonzero((keys != self._keys).any(axis=1)):
                self._strips.pop(int(row), None)
                self.refresh(Region(0, int(row), keys.shape[1], 1))
        self._keys = keys

    def render_line(self, y: int) -> Strip:
        """Render one row of the map."""
        cells = self.cells
        if cells is None or y >= cells.codes.shape[0]:
            return Strip.blank(self.size.width)
        strip = self._strips.get(y)
        if strip is None:
            strip = self._strips[y] = self._strip(cells, y)
        return strip

    def _strip(self, cells: Cells, row: int) -> Strip:
        styles = cells.inks[row] * np.uint8(2) + cells.stripe
        starts = np.concatenate(([0], np.flatnonzero(np.diff(styles)) + 1, [len(styles)]))
        text = cells.codes[row].astype("<u4").tobytes().decode("utf-32-le")
        segments = [
            Segment(text[first:last], self._styles[styles[first]])
            for first, last in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)
        ]
        return Strip(segments, len(text))
