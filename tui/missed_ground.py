"""Missed ground of a covering tool, on a raster independent of the map's scale."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.tui.area_dots import AreaScene, Dots, Numbers, band, inside, last_segment
from touchline.tui.viewport import DOTS_X, DOTS_Y, Viewport

NEAR_WIDTHS: Final = 3.0
"""Width (in widths of the tool) of the band about the track in which uncovered ground counts as missed."""
CELLS_A_WIDTH: Final = 25.0
"""Cells per width of the tool; fewer on large areas."""
MOST_CELLS: Final = 2_000_000
THICK_CELLS: Final = 3
"""Thickness (cells) below which a patch is an artefact of the raster."""
LATE_POINTS: Final = 25
"""Track points, 5 cm apart, between searches for patches."""


@dataclass
class MissedGround:
    """Missed patches of the areas, in cells of a raster that is fixed to the field."""

    _raster: Viewport = field(default_factory=lambda: Viewport(1, 1))
    _areas: object = None
    _inside: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _planned: tuple[int, float] = (-1, 0.0)
    _last: Numbers = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    _drawn: tuple[int, int, float] = (-1, 0, 0.0)
    _covered: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _passed: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _looked: tuple[object, ...] = ()
    _points: tuple[NDArray[np.float64], NDArray[np.float64]] = field(default_factory=lambda: (np.zeros(0), np.zeros(0)))

    def dots(self, view: Viewport, scene: AreaScene) -> Dots:
        """Dots (height, width) of a view with any part of a patch."""
        self._update(scene)
        u, v = view.to_dots(*self._points)
        seen = (u >= 0) & (u < view.width) & (v >= 0) & (v < view.height)
        found = np.zeros((view.height, view.width), dtype=np.bool_)
        found[v[seen].astype(np.int64), u[seen].astype(np.int64)] = True
        return found

    def _update(self, scene: AreaScene) -> None:
        if scene.areas is not self._areas:
            self._areas, self._raster = scene.areas, _raster_of(scene)
            self._inside = inside(self._raster, scene.areas)
            self._planned, self._drawn, self._looked = (-1, 0.0), (-1, 0, 0.0), ()
        if self._planned != (scene.plan_revision, scene.width_m):
            self._planned = scene.plan_revision, scene.width_m
            self._last = last_segment(self._raster, scene)
        self._draw(scene)
        looked = (self._planned, scene.at, scene.track_revision, len(scene.track) // LATE_POINTS)
        if looked != self._looked:
            self._looked, self._points = looked, self._patches(scene)

    def _draw(self, scene: AreaScene) -> None:
        """Enter the new part of the tool's track; a cell counts as covered if its middle is."""
        revision, drawn, width_m = self._drawn
        if revision != scene.track_revision or width_m != scene.width_m or drawn > len(scene.track):
            drawn = 0
            self._covered, self._passed = np.zeros_like(self._inside), np.zeros_like(self._inside)
        new = scene.track.since(drawn)
        narrow_m = scene.width_m - self._raster.dot_m
        for dots, width in ((self._covered, narrow_m), (self._passed, NEAR_WIDTHS * scene.width_m)):
            row, column = band(self._raster, new, width)
            dots[row, column] = True
        self._drawn = scene.track_revision, len(scene.track), scene.width_m

    def _patches(self, scene: AreaScene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Middles of all cells of patches, in the field's frame."""
        from scipy import ndimage

        missed = self._inside & ~self._covered
        if scene.at is not None:
            missed &= self._passed & (self._last < scene.at)
        thick = ndimage.binary_erosion(missed, np.ones((THICK_CELLS, THICK_CELLS), dtype=np.bool_))
        numbers, _ = ndimage.label(missed)
        kept = np.zeros(int(numbers.max(initial=0)) + 1, dtype=np.bool_)
        kept[numbers[thick]] = True
        kept[0] = False
        row, column = np.nonzero(kept[numbers])
        raster = self._raster
        u, v = column.astype(np.float64), row.astype(np.float64)
        x = raster.center_x_m + (u + 0.5 - raster.width / 2) * raster.dot_m
        y = raster.center_y_m - (v + 0.5 - raster.height / 2) * raster.dot_height_m
        return x, y


def _raster_of(scene: AreaScene) -> Viewport:
    """Raster over the bounds of the areas."""
    corners = np.vstack([np.array(area.outline) for area in scene.areas])
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    edge_m = max(scene.width_m / CELLS_A_WIDTH, math.sqrt((x1 - x0) * (y1 - y0) / MOST_CELLS))
    columns, rows = math.ceil((x1 - x0) / edge_m / DOTS_X), math.ceil((y1 - y0) / edge_m / DOTS_Y)
    return Viewport(max(columns, 1), max(rows, 1), float(x0 + x1) / 2, float(y0 + y1) / 2, float(edge_m))
