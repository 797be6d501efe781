"""Map without colours: shapes replace them."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from touchline.tui import theme
from touchline.tui.map_raster import Cells, Ink
from touchline.tui.raster import BRAILLE_BASE

EVERY_OTHER_DOT: Final = 0x95
"""Chessboard pattern of the eight dots of a cell: lines in all directions are dotted."""
MARKS: Final = {
    Ink.PATH: "·",
    Ink.CURRENT_PATH: "•",
    Ink.LIMIT: "+",
    Ink.SLOW_ZONE: "~",
    Ink.STOP_ZONE: "=",
    Ink.SEEN: "#",
}
"""Marks of transitions, the current transition, limits of the body, zones, and outlines of obstacles seen."""
STYLES: Final = {Ink.CURRENT: (theme.YELLOW, "reverse"), Ink.CURRENT_PATH: (theme.SKY, "bold")}


def in_shapes(cells: Cells) -> Cells:
    """Convert colours to shapes: unpainted lines are dotted, painted ones solid, others have marks."""
    codes = cells.codes.copy()
    dotted = (codes - BRAILLE_BASE) & EVERY_OTHER_DOT
    thin = (cells.inks == Ink.TEMPLATE) & (codes >= BRAILLE_BASE) & (dotted > 0)
    codes[thin] = (dotted + BRAILLE_BASE)[thin]
    for ink, mark in MARKS.items():
        codes[cells.inks == ink] = ord(mark)
    codes[cells.inks == Ink.GRID] = ord(" ")
    return replace(cells, codes=codes.astype(np.uint32))
