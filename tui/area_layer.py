"""The ground that a covering tool has been over, on the map: the band of its strokes, and what they have left out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.tui.area_dots import AreaScene, Dots, band
from touchline.tui.missed_ground import MissedGround
from touchline.tui.raster import to_bits
from touchline.tui.viewport import DOTS_X, DOTS_Y, Viewport


@dataclass
class AreaLayer:
    """Dots of the areas in a view: each update draws only what is new in it."""

    _view: Viewport | None = None
    _drawn: tuple[int, int, float] = (-1, 0, 0.0)
    _covered: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _ground: MissedGround = field(default_factory=MissedGround)

    def update(self, view: Viewport, scene: AreaScene) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Braille bits (rows, columns) of the ground that is covered, and of that which is left out."""
        if view != self._view:
            self._view, self._drawn = view, (-1, 0, 0.0)
        self._draw_way(view, scene)
        missed = self._ground.dots(view, scene)
        for x_m, y_m in scene.missed:
            if (cell := view.to_cell(x_m, y_m)) is not None:
                missed[cell[1] * DOTS_Y, cell[0] * DOTS_X] = True
        return to_bits(view, self._covered), to_bits(view, missed)

    def _draw_way(self, view: Viewport, scene: AreaScene) -> None:
        revision, drawn, width_m = self._drawn
        if revision != scene.way_revision or width_m != scene.width_m or drawn > len(scene.way):
            drawn, self._covered = 0, np.zeros((view.height, view.width), dtype=np.bool_)
        row, column = band(view, scene.way.since(drawn), scene.width_m)
        self._covered[row, column] = True
        self._drawn = scene.way_revision, len(scene.way), scene.width_m
