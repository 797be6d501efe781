"""Areas, their plan and a tool's track as dots of a viewport."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.template import Area
from touchline.tui.raster import Polyline, clip
from touchline.tui.viewport import Viewport

SAMPLES_A_DOT = 2.0

Dots = NDArray[np.bool_]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class AreaScene:
    """Areas, with the work on them.

    Attributes:
        areas: Areas to cover.
        track: Ground track of the tool so far; it only grows as long as the revision stays the same.
        width_m: Width of the tool.
        plan: Planned path of the tool, segment by segment.
        at: Segment at which the tool is; None: the work is over.
        missed: (n, 2) missed places by the final report.
    """

    areas: tuple[Area, ...]
    track: Polyline
    track_revision: int
    width_m: float
    plan: tuple[Polyline, ...] = ()
    plan_revision: int = 0
    at: int | None = 0
    missed: tuple[tuple[float, float], ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """Key that is equal for scenes that look the same."""
        return (
            id(self.areas),
            self.track_revision,
            len(self.track),
            self.width_m,
            self.plan_revision,
            self.at,
            self.missed,
        )


def inside(view: Viewport, areas: tuple[Area, ...]) -> Dots:
    """Dots (height, width) whose middle is in an area."""
    import shapely

    x = view.center_x_m + (np.arange(view.width) + 0.5 - view.width / 2) * view.dot_m
    y = view.center_y_m - (np.arange(view.height) + 0.5 - view.height / 2) * view.dot_height_m
    found = np.zeros((view.height, view.width), dtype=np.bool_)
    for area in areas:
        found |= shapely.contains_xy(area.polygon, x[None, :], y[:, None])
    return found


def last_segment(view: Viewport, scene: AreaScene) -> Numbers:
    """Last segment (height, width) of the plan in which the tool passes over each dot; −1: none."""
    last = np.full((view.height, view.width), -1, dtype=np.int64)
    for number, line in enumerate(scene.plan):
        row, column = band(view, line, scene.width_m)
        last[row, column] = number
    return last


def band(view: Viewport, line: Polyline, width_m: float) -> tuple[Numbers, Numbers]:
    """Dots, as (rows, columns), of the band about a polyline."""
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
