"""Map layer of covering tools: the covered band and missed ground."""

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
    """Dots of the areas in a view; each update draws only what is new."""

    _view: Viewport | None = None
    _drawn: tuple[int, int, float] = (-1, 0, 0.0)
    _covered: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _ground: MissedGround = field(default_factory=MissedGround)

    def update(self, view: Viewport, scene: AreaScene) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Braille bits (rows, columns) of covered and of missed ground."""
        if view != self._view:
            self._view, self._drawn = view, (-1, 0, 0.0)
        self._draw_track(view, scene)
        missed = self._ground.dots(view, scene)
        for x_m, y_m in scene.missed:
            if (cell := view.to_cell(x_m, y_m)) is not None:
                missed[cell[1] * DOTS_Y, cell[0] * DOTS_X] = True
        return to_bits(view, self._covered), to_bits(view, missed)

    def _draw_track(self, view: Viewport, scene: AreaScene) -> None:
        revision, drawn, width_m = self._drawn
        if revision != scene.track_revision or width_m != scene.width_m or drawn > len(scene.track):
            drawn, self._covered = 0, np.zeros((view.height, view.width), dtype=np.bool_)
        row, column = band(view, scene.track.since(drawn), scene.width_m)
        self._covered[row, column] = True
        self._drawn = scene.track_revision, len(scene.track), scene.width_m
