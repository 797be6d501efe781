"""Picture that compares a drawing with its template: drawn lines on the paint at its true width."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from touchline.drawings.deviation import sampled
from touchline.drawings.importer import Imported
from touchline.drawings.outline import Floats
from touchline.drawings.picture import GRASS, PAINT
from touchline.schemas.curves import Curve
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Area

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path as Path2D

JOINT, DRAWN, LEFT_OUT, WORST = "#2a5db0", "#111111", "#ff9d2e", "#e0202a"
#: Longer side of the picture, margin around it and above it for the title, inches; dots per inch of a .png.
SIDE_IN, MARGIN_IN, TITLE_IN, DPI = 11.0, 0.3, 0.75, 160
#: Room around the drawing, as a fraction of its size; minimum ratio of the sides of the picture.
ROOM_SHARE, SLIMMEST = 0.05, 0.45
#: Minimum width of lines, points; points per inch.
THINNEST_PT, POINTS_PER_IN = 0.8, 72.0
#: Turn (rad) from which a piece is drawn as two straight ones.
BEND_RAD = 0.05


def draw_comparison(imported: Imported, path: Path) -> None:
    """Draw what was imported to ``path`` (.svg or .png).

    The drawing's own lines are thin and black on the paint, dots mark the ends of lines and arcs, what is not painted
    is orange, and a ring marks the largest deviation.

    Raises:
        OSError: The file cannot be written.
        ValueError: The suffix names no known format.
    """
    from matplotlib.collections import LineCollection, PathCollection
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    template = imported.template
    painted = [segment.curve() for segment in template.segments]
    edges = [edge for area in template.areas for edge in area.edges()]
    low, high = _frame([*painted, *edges, *imported.drawn, *imported.left_out], template.line_width_m)
    inches_per_m = SIDE_IN / float((high - low).max())
    width, height = (float(v) * inches_per_m for v in high - low)
    page = (width + 2 * MARGIN_IN, height + 2 * MARGIN_IN + TITLE_IN)
    figure = Figure(figsize=page)
    box = (MARGIN_IN / page[0], MARGIN_IN / page[1], width / page[0], height / page[1])
    axes = figure.add_axes(box, facecolor=GRASS, xticks=[], yticks=[])
    axes.set_xlim(float(low[0]), float(high[0]))
    axes.set_ylim(float(low[1]), float(high[1]))
    breadth = max(POINTS_PER_IN * inches_per_m * template.line_width_m, THINNEST_PT)
    thin = min(max(breadth / 12, 0.5), 1.0)
    for curves, colour, points, order in (
        (painted, PAINT, breadth, 1),
        (imported.drawn, DRAWN, thin, 2),
        (imported.left_out, LEFT_OUT, 2 * thin, 3),
    ):
        lines = LineCollection(_lines(curves), colors=colour, linewidths=points, zorder=order)
        lines.set_capstyle("butt")
        axes.add_collection(lines)
    axes.add_collection(PathCollection([_shape(area) for area in template.areas], facecolors=PAINT, zorder=0.5))
    joints = [*painted, *edges]
    ends = np.array([(curve.x_m, curve.y_m) for curve in joints] + [curve.end[:2] for curve in joints])
    axes.plot(ends[:, 0], ends[:, 1], "o", color=JOINT, markersize=min(max(breadth / 3, 1.2), 3.5), zorder=4)
    _mark_worst(axes, imported, low, high)
    title = plain(template.title or template.name, 60)
    top = 1.0 - 0.35 / page[1]
    figure.text(MARGIN_IN / page[0], top, title, fontweight="bold", fontsize=13)
    metres = high - low - 2 * ROOM_SHARE * float((high - low).max())
    size = f"{metres[0]:.1f} x {metres[1]:.1f} m" if min(metres) > 0 else ""
    areas = f"{template.area_m2:,.1f} m² of areas, " if template.areas else ""
    caption = f"{len(painted)} lines and arcs, {template.length_m:.1f} m, {areas}{size}"
    figure.text(1.0 - MARGIN_IN / page[0], top, caption, fontsize=9, ha="right")
    entries = [
        Line2D([], [], color=DRAWN, lw=1, label="drawn"),
        Line2D([], [], color=JOINT, marker="o", lw=0, markersize=4, label="ends of lines and arcs"),
    ]
    if imported.left_out:
        entries.append(Line2D([], [], color=LEFT_OUT, lw=2, label="left out"))
    if imported.deviation_m > 0.0:
        worst = f"farthest apart: {1e3 * imported.deviation_m:.1f} mm"
        entries.append(Line2D([], [], color=WORST, marker="o", markerfacecolor="none", lw=0, label=worst))
    at = (MARGIN_IN / page[0], 1.0 - (MARGIN_IN + TITLE_IN - 0.1) / page[1])
    figure.legend(handles=entries, loc="lower left", bbox_to_anchor=at, ncols=4, frameon=False, fontsize=8, borderpad=0)
    figure.savefig(path, dpi=DPI)


def _mark_worst(axes: "Axes", imported: Imported, low: Floats, high: Floats) -> None:
    """Draw a ring around the largest deviation between drawing and template, and its figure."""
    if imported.deviation_m <= 0.0:
        return
    x, y = imported.farthest_m
    axes.plot([x], [y], "o", markersize=16, markerfacecolor="none", markeredgecolor=WORST, markeredgewidth=2, zorder=5)
    middle = (low + high) / 2
    side, rise = (1 if x < middle[0] else -1), (1 if y < middle[1] else -1)
    axes.annotate(
        f"{1e3 * imported.deviation_m:.1f} mm",
        (x, y),
        xytext=(22 * side, 16 * rise),
        textcoords="offset points",
        ha="left" if side > 0 else "right",
        va="center",
        fontsize=10,
        fontweight="bold",
        color=WORST,
        bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": WORST},
        zorder=6,
    )


def _frame(curves: Sequence[Curve], line_width_m: float) -> tuple[Floats, Floats]:
    """Lowest and highest (x, y) that the picture shows, m."""
    points = np.concatenate([sampled(curve, 2 if curve.curvature_1pm == 0.0 else 33) for curve in curves])
    low, high = points.min(axis=0), points.max(axis=0)
    room = ROOM_SHARE * float((high - low).max()) + line_width_m
    low, high = low - room, high + room
    lacking = np.maximum(SLIMMEST * float((high - low).max()) - (high - low), 0.0) / 2
    return low - lacking, high + lacking


def _shape(area: Area) -> "Path2D":
    """Path of an area, with outline and holes in opposite directions for the picture's fill rule."""
    from matplotlib.path import Path as Path2D
    from shapely import get_coordinates, orient_polygons

    polygon = orient_polygons(area.polygon)
    rings = (polygon.exterior, *polygon.interiors)
    return Path2D.make_compound_path(*(Path2D(get_coordinates(ring), closed=True) for ring in rings))


def _lines(curves: Sequence[Curve]) -> list[Floats]:
    return [sampled(c, int(np.ceil(abs(c.curvature_1pm) * c.length_m / BEND_RAD)) + 2) for c in curves]
