"""The map without colours: what is told by a colour elsewhere is told by a shape."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from touchline.tui import theme
from touchline.tui.map_raster import Cells, Ink
from touchline.tui.raster import BRAILLE_BASE

EVERY_OTHER_DOT: Final = 0x95
"""Of the eight of a cell, as on a chessboard: a line of them is dotted, whichever way it goes."""
MARKS: Final = {Ink.PATH: "·", Ink.CURRENT_PATH: "•", Ink.LIMIT: "+"}
"""What is driven, what is being driven now, and where the body must stay."""
STYLES: Final = {Ink.CURRENT: (theme.YELLOW, "reverse"), Ink.CURRENT_PATH: (theme.SKY, "bold")}


def in_shapes(cells: Cells) -> Cells:
    """The same map: what is to be painted is dotted, what is painted is drawn through, the rest has marks."""
    codes = cells.codes.copy()
    dotted = (codes - BRAILLE_BASE) & EVERY_OTHER_DOT
    thin = (cells.inks == Ink.TEMPLATE) & (codes >= BRAILLE_BASE) & (dotted > 0)
    codes[thin] = (dotted + BRAILLE_BASE)[thin]
    for ink, mark in MARKS.items():
        codes[cells.inks == ink] = ord(mark)
    codes[cells.inks == Ink.GRID] = ord(" ")
    return replace(cells, codes=codes.astype(np.uint32))
