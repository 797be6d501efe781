"""Picture of the paint: true strokes at their true width, coloured by distance from the template.

Wet paint carried by wheels and casters is shown where they printed it, as faint as it is there.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from touchline.recordings.writing import writing
from touchline.schemas.curves import Curve
from touchline.schemas.messages import PaintMarks, Smear
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Template
from touchline.services.planner.plots.ground import fill_obstacles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

Floats = npt.NDArray[np.float64]

GRASS, EDGE = "#3f6b3a", "#1f3a1c"
FIGURE_SIZE_IN = (12.0, 7.6)
#: End of the colour scale; larger errors have its last colour.
LARGEST_ERROR_MM = 30.0
#: Least drawn width: lines are a thousandth as wide as a pitch and would vanish at true scale.
MIN_WIDTH_PT = 1.6


def draw_painted(
    template: Template, strokes: Iterable[PaintMarks], path: Path, caption: str = "", smears: Iterable[Smear] = ()
) -> None:
    """Draw ``strokes`` and ``smears`` to ``path`` (.svg or .png).

    Args:
        template: The template, with lines.
        strokes: True paint.
        path: File to write.
        caption: The main figures.
        smears: Paint printed by wheels and casters.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
    paint(figure.add_subplot(), template, strokes, caption, smears)
    with writing(path):
        figure.savefig(path, dpi=140)


def paint(
    axes: "Axes", template: Template, strokes: Iterable[PaintMarks], caption: str = "", smears: Iterable[Smear] = ()
) -> None:
    """Draw ``strokes`` and ``smears`` into axes; see `draw_painted`.

    Args:
        axes: Axes of matplotlib.
        template: The template, with lines.
        strokes: True paint.
        caption: The main figures.
        smears: Paint printed by wheels and casters.
    """
    from matplotlib.collections import LineCollection

    axes.set_facecolor(GRASS)
    curves = {segment.id: segment.curve() for segment in template.segments}
    edges = [edge for area in template.areas for edge in area.edges()]
    _frame(axes, [*curves.values(), *edges])
    for edge in edges:
        x, y, _, _ = edge.at(np.array((0.0, edge.length_m)))
        axes.plot(x, y, color=EDGE, linewidth=0.8)
    for curve in curves.values():  # seen where nothing is painted
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, 50))
        axes.plot(x, y, color=EDGE, linewidth=0.8)
    fill_obstacles(axes, template)
    _smear(axes, list(smears))
    colours = None
    for stroke in strokes:
        points = np.column_stack((stroke.x_m, stroke.y_m))
        if len(points) < 2 or not template.paints(stroke.segment_id):
            continue
        width_pt = max(MIN_WIDTH_PT, _points_per_metre(axes) * stroke.width_m)
        if stroke.segment_id not in curves:
            # Of an area the template has the edges, not the swaths: there is nothing to measure distances from.
            axes.plot(*points.T, color="#ffffff", linewidth=width_pt, solid_capstyle="butt")
            continue
        pieces = np.stack((points[:-1], points[1:]), axis=1)
        error_mm = 1e3 * np.abs(lateral_error(curves[stroke.segment_id], points[:-1]))
        colours = LineCollection(list(pieces), array=error_mm, cmap=_paint_colours(), clim=(0.0, LARGEST_ERROR_MM))
        colours.set_linewidth(width_pt)
        axes.add_collection(colours)
    if colours is not None:
        axes.figure.colorbar(colours, ax=axes, label="nozzle off the template (mm)", shrink=0.7, extend="max")
    axes.set_title(plain(template.title or template.name, 200) + "\n", fontweight="bold", loc="left")
    axes.set_title(caption, fontsize="small", loc="right")


def painted_caption(paint: Mapping[str, Any]) -> str:
    """Return a report's main figures as a caption."""
    return (
        f"covered {paint['coverage_pct']:.2f} % of the length, {paint['area_coverage_pct']:.2f} % of the area, "
        f"off by {1e3 * paint['lateral_error_m']['p95']:.1f} mm (p95), "
        f"{paint['within_tolerance_pct']:.2f} % within {1e3 * paint['tolerance_m']:g} mm"
    )


def lateral_error(curve: Curve, points_m: Floats) -> Floats:
    """Signed distance (m, left positive) of points (n, 2) from a line or arc carried on beyond its ends."""
    dx, dy = points_m[:, 0] - curve.x_m, points_m[:, 1] - curve.y_m
    left: Floats = -np.sin(curve.heading_rad) * dx + np.cos(curve.heading_rad) * dy
    if curve.curvature_1pm == 0.0:
        return left
    radius = 1.0 / curve.curvature_1pm
    from_centre = np.hypot(dx + radius * np.sin(curve.heading_rad), dy - radius * np.cos(curve.heading_rad))
    return np.asarray(np.sign(radius) * (abs(radius) - from_centre))


def _smear(axes: "Axes", smears: list[Smear]) -> None:
    from matplotlib.collections import LineCollection

    drawn = [smear for smear in smears if len(smear.x_m) == len(smear.y_m) > 1]
    if drawn:
        widths = [max(MIN_WIDTH_PT, _points_per_metre(axes) * smear.width_m) for smear in drawn]
        white = [(1.0, 1.0, 1.0, min(1.0, max(0.0, smear.strength))) for smear in drawn]
        lines = [np.column_stack((smear.x_m, smear.y_m)) for smear in drawn]
        axes.add_collection(LineCollection(lines, linewidths=widths, colors=white, capstyle="butt", gid="smears"))


def _frame(axes: "Axes", curves: list[Curve]) -> None:
    """Fit the axes to the template with a margin, equal scales, metres."""
    sampled = [curve.at(np.linspace(0.0, curve.length_m, 50)) for curve in curves]
    x, y = np.concatenate([s[0] for s in sampled]), np.concatenate([s[1] for s in sampled])
    margin = 0.04 * max(np.ptp(x), np.ptp(y))
    axes.set_xlim(x.min() - margin, x.max() + margin)
    axes.set_ylim(y.min() - margin, y.max() + margin)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")


def _paint_colours() -> "Colormap":
    """Return a colour map: white where the paint is right, through yellow to red where it is not."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("paint", ["#ffffff", "#ffe36e", "#ff8c1a", "#e0202a"])


def _points_per_metre(axes: "Axes") -> float:
    low, high = axes.get_xlim()
    return 72.0 * 0.8 * FIGURE_SIZE_IN[0] / (high - low)
