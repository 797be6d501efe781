"""The ground that a covering tool has been over, on the map: the band of its strokes, and what they have left out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.template import Area
from touchline.tui.raster import Polyline, clip, to_bits
from touchline.tui.viewport import Viewport

NEAR_WIDTHS = 3.0
"""Ground is left out once the tool has passed by, within this band about its way (in widths of the tool)."""
SAMPLES_A_DOT = 2.0

Dots = NDArray[np.bool_]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class AreaScene:
    """Areas, and what has been done about them.

    Attributes:
        areas: To be covered.
        way: Of the tool so far; only another revision says that it is another way, not growth.
        width_m: Of the tool.
        plan: Its planned way, segment by segment.
        at: The segment at which it is; None: it comes no more.
    """

    areas: tuple[Area, ...]
    way: Polyline
    way_revision: int
    width_m: float
    plan: tuple[Polyline, ...] = ()
    plan_revision: int = 0
    at: int | None = 0

    @property
    def key(self) -> tuple[object, ...]:
        """Equal for scenes that look the same."""
        return id(self.areas), self.way_revision, len(self.way), self.width_m, self.plan_revision, self.at


@dataclass
class AreaLayer:
    """Dots of the areas in a view: each update draws only what is new in it."""

    _view: Viewport | None = None
    _areas: tuple[Area, ...] = ()
    _inside: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _planned: tuple[int, float] = (-1, 0.0)
    _last: Numbers = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    _drawn: tuple[int, int, float] = (-1, 0, 0.0)
    _covered: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))
    _passed: Dots = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))

    def update(self, view: Viewport, scene: AreaScene) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Braille bits (rows, columns) of the ground that is covered, and of that which is left out."""
        if view != self._view:
            self._view, self._areas, self._planned, self._drawn = view, (), (-1, 0.0), (-1, 0, 0.0)
        if scene.areas is not self._areas:
            self._areas, self._inside = scene.areas, _inside(view, scene.areas)
        if self._planned != (scene.plan_revision, scene.width_m):
            self._planned, self._last = (scene.plan_revision, scene.width_m), _last_segment(view, scene)
        self._draw_way(view, scene)
        missed = self._inside & ~self._covered
        if scene.at is not None:
            missed &= self._passed & (self._last < scene.at)
        return to_bits(view, self._covered), to_bits(view, missed)

    def _draw_way(self, view: Viewport, scene: AreaScene) -> None:
        revision, drawn, width_m = self._drawn
        if revision != scene.way_revision or width_m != scene.width_m or drawn > len(scene.way):
            drawn = 0
            self._covered, self._passed = (np.zeros((view.height, view.width), dtype=np.bool_) for _ in range(2))
        new = scene.way.since(drawn)
        for dots, width in ((self._covered, scene.width_m), (self._passed, NEAR_WIDTHS * scene.width_m)):
            row, column = _band(view, new, width)
            dots[row, column] = True
        self._drawn = scene.way_revision, len(scene.way), scene.width_m


def _inside(view: Viewport, areas: tuple[Area, ...]) -> Dots:
    """(height, width) dots whose middle is in an area."""
    import shapely

    x = view.center_x_m + (np.arange(view.width) + 0.5 - view.width / 2) * view.dot_m
    y = view.center_y_m - (np.arange(view.height) + 0.5 - view.height / 2) * view.dot_height_m
    found = np.zeros((view.height, view.width), dtype=np.bool_)
    for area in areas:
        found |= shapely.contains_xy(area.polygon, x[None, :], y[:, None])
    return found


def _last_segment(view: Viewport, scene: AreaScene) -> Numbers:
    """(height, width) the last segment of the plan in which the tool passes over each dot; −1: in none."""
    last = np.full((view.height, view.width), -1, dtype=np.int64)
    for number, line in enumerate(scene.plan):
        row, column = _band(view, line, scene.width_m)
        last[row, column] = number
    return last


def _band(view: Viewport, line: Polyline, width_m: float) -> tuple[Numbers, Numbers]:
    """(row, column) of the dots in the band of that width about a polyline."""
    joined = line.joined[1:]
    half = 0.5 * width_m
    pad = half / min(view.dot_m, view.dot_height_m)
    u, v = (axis + pad for axis in view.to_dots(line.x_m, line.y_m))
    size = round(view.width + 2 * pad), round(view.height + 2 * pad)
    u0, v0, u1, v1 = (axis - pad for axis in clip(u[:-1][joined], v[:-1][joined], u[1:][joined], v[1:][joined], *size))
    dx, dy = (u1 - u0) * view.dot_m, (v1 - v0) * view.dot_height_m
    length = np.hypot(dx, dy)
    step = min(view.dot_m, view.dot_height_m) / SAMPLES_A_DOT
    count = np.ceil(length / step).astype(np.int64) + (length > 0.0)
    segment = np.repeat(np.arange(len(count)), count)
    along = (np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)) / np.maximum(count - 1, 1)[segment]
    across = np.linspace(-half, half, int(np.ceil(width_m / step)) + 1)
    with np.errstate(invalid="ignore"):
        aside_u, aside_v = (-dy / length / view.dot_m)[segment], (dx / length / view.dot_height_m)[segment]
    us = (u0[segment] + along * (u1 - u0)[segment])[:, None] + aside_u[:, None] * across
    vs = (v0[segment] + along * (v1 - v0)[segment])[:, None] + aside_v[:, None] * across
    seen = (us >= 0) & (us < view.width) & (vs >= 0) & (vs < view.height)
    return vs[seen].astype(np.int64), us[seen].astype(np.int64)
