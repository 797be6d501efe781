"""Raster of polylines in metres as braille bits per cell, in vectorised NumPy passes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.tui.viewport import DOTS_X, DOTS_Y, Viewport

BRAILLE_BASE = 0x2800

_BIT = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint8)
"""Unicode's dot numbering: _BIT[row of the dot, column of the dot]."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """Polyline with gaps: the line from point i-1 to point i is drawn where `joined[i]` (so joined[0] is False).

    A point with no line on either side is drawn as one dot.
    """

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    joined: NDArray[np.bool_]

    @classmethod
    def of(cls, strokes: list[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> Polyline:
        """Create one polyline from separate strokes, each (x (n,), y (n,))."""
        strokes = [stroke for stroke in strokes if len(stroke[0])]
        if not strokes:
            return EMPTY
        joined = [np.arange(len(x)) > 0 for x, _ in strokes]
        return cls(
            np.concatenate([x for x, _ in strokes]),
            np.concatenate([y for _, y in strokes]),
            np.concatenate(joined),
        )

    def __len__(self) -> int:
        return len(self.x_m)

    def since(self, index: int) -> Polyline:
        """Part drawn by points `index` and later, with the point before it."""
        first = max(index - 1, 0)
        return Polyline(self.x_m[first:], self.y_m[first:], self.joined[first:])

    def bounds(self) -> tuple[float, float, float, float] | None:
        """Bounds (x_min, y_min, x_max, y_max) in metres of the finite points, None without any."""
        ok = np.isfinite(self.x_m) & np.isfinite(self.y_m)
        if not ok.any():
            return None
        x, y = self.x_m[ok], self.y_m[ok]
        return float(x.min()), float(y.min()), float(x.max()), float(y.max())


EMPTY = Polyline(np.empty(0), np.empty(0), np.empty(0, dtype=np.bool_))


def dashed(line: Polyline, dash_m: float) -> Polyline:
    """Divide a line into dashes and gaps of a length; unchanged if a point is not finite."""
    if not len(line):
        return line
    at_m = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(line.x_m), np.diff(line.y_m)))))
    if not np.isfinite(at_m[-1]):
        return line
    cuts_m = np.arange(1, int(at_m[-1] / dash_m) + 1) * dash_m
    before = np.searchsorted(at_m, cuts_m).clip(max=len(line) - 1)
    all_m = np.insert(at_m, before, cuts_m)
    joined = np.insert(line.joined, before, line.joined[before])
    joined[1:] &= (all_m[1:] + all_m[:-1]) // (2 * dash_m) % 2 == 0
    ends = joined | np.append(joined[1:], False)  # a point that is left alone in a gap would be drawn as a dot
    x, y = (np.interp(all_m[ends], at_m, axis) for axis in (line.x_m, line.y_m))
    return Polyline(x, y, joined[ends])


def draw(bits: NDArray[np.uint8], view: Viewport, line: Polyline) -> None:
    """Set the dots of `line` in `bits` (rows, columns) as seen through `view`; points not finite are skipped."""
    if not len(line):
        return
    u, v = view.to_dots(line.x_m, line.y_m)
    joined = line.joined[1:]
    u0, v0, u1, v1 = clip(u[:-1][joined], v[:-1][joined], u[1:][joined], v[1:][joined], view.width, view.height)
    su, sv = _sample(u0, v0, u1, v1)
    single = ~line.joined
    single[:-1] &= ~joined
    _set_dots(bits, view, np.concatenate((su, u[single])), np.concatenate((sv, v[single])))


def clip(
    u0: NDArray[np.float64],
    v0: NDArray[np.float64],
    u1: NDArray[np.float64],
    v1: NDArray[np.float64],
    width: int,
    height: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Clip all segments to the window by Liang and Barsky's algorithm, so that zooming in far stays cheap."""
    near = (
        (np.maximum(u0, u1) >= 0)
        & (np.minimum(u0, u1) < width)
        & (np.maximum(v0, v1) >= 0)
        & (np.minimum(v0, v1) < height)
    )
    u0, v0, u1, v1 = u0[near], v0[near], u1[near], v1[near]
    if not len(u0):
        return u0, v0, u1, v1
    if (
        min(u0.min(), u1.min(), v0.min(), v1.min()) >= 0
        and max(u0.max(), u1.max()) < width
        and max(v0.max(), v1.max()) < height
    ):
        return u0, v0, u1, v1
    du, dv = u1 - u0, v1 - v0
    enter = np.zeros(len(u0))
    leave = np.ones(len(u0))
    with np.errstate(divide="ignore", invalid="ignore"):
        for step, room in ((-du, u0), (du, width - u0), (-dv, v0), (dv, height - v0)):
            ratio = room / step
            enter = np.where(step < 0, np.maximum(enter, ratio), enter)
            leave = np.where(step > 0, np.minimum(leave, ratio), leave)
            leave = np.where((step == 0) & (room < 0), -1.0, leave)
    keep = enter <= leave
    u0, v0, du, dv, enter, leave = u0[keep], v0[keep], du[keep], dv[keep], enter[keep], leave[keep]
    return u0 + enter * du, v0 + enter * dv, u0 + leave * du, v0 + leave * dv


def _sample(
    u0: NDArray[np.float64], v0: NDArray[np.float64], u1: NDArray[np.float64], v1: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sample every segment, both ends included, at most one dot apart along its longer axis."""
    if not len(u0):
        return u0, v0
    steps = np.ceil(np.maximum(np.abs(u1 - u0), np.abs(v1 - v0))).astype(np.int64)
    count = steps + 1
    segment = np.repeat(np.arange(len(u0)), count)
    first = np.cumsum(count) - count
    t = (np.arange(len(segment)) - first[segment]) / np.maximum(steps, 1)[segment]
    return u0[segment] + t * (u1 - u0)[segment], v0[segment] + t * (v1 - v0)[segment]


def _set_dots(bits: NDArray[np.uint8], view: Viewport, u: NDArray[np.float64], v: NDArray[np.float64]) -> None:
    inside = (u >= 0) & (u < view.width) & (v >= 0) & (v < view.height)
    if not inside.any():
        return
    dots = np.zeros((view.height, view.width), dtype=np.bool_)
    dots[v[inside].astype(np.intp), u[inside].astype(np.intp)] = True
    bits |= to_bits(view, dots)


def to_bits(view: Viewport, dots: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Convert dots (height, width) to bits of cells (rows, columns)."""
    cells = dots.reshape(view.rows, DOTS_Y, view.columns, DOTS_X)
    bits = np.zeros((view.rows, view.columns), dtype=np.uint8)
    for row in range(DOTS_Y):
        for column in range(DOTS_X):
            bits |= cells[:, row, :, column] * _BIT[row, column]
    return bits


@dataclass
class GrowingLayer:
    """Braille bits of a polyline that only grows: each update draws only the new points."""

    bits: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((1, 1), dtype=np.uint8))
    view: Viewport | None = None
    drawn: int = 0
    revision: int = -1

    def update(self, view: Viewport, line: Polyline, revision: int) -> bool:
        """Draw new points; another view or `revision` starts again. True if anything was drawn."""
        if view != self.view or revision != self.revision or len(line) < self.drawn:
            self.bits = np.zeros((view.rows, view.columns), dtype=np.uint8)
            self.view, self.revision, self.drawn = view, revision, 0
        elif len(line) == self.drawn:
            return False
        draw(self.bits, view, line.since(self.drawn))
        self.drawn = len(line)
        return True
