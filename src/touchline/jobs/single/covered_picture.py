"""Picture of the areas that a covering tool has been over: covered once, covered twice, and missed."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from touchline.core.missed_patches import patches
from touchline.core.robust_overlay import difference, union
from touchline.recordings.writing import writing
from touchline.schemas.messages import AreaReport, PaintMarks
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Polygon, Template
from touchline.services.planner.plots.ground import (
    AREA_EDGE,
    BOUNDARY,
    COVERED,
    GROUND,
    MISSED,
    OBSTACLE,
    TWICE,
    fill_ground,
    outline_ground,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from shapely.geometry.base import BaseGeometry

FIGURE_SIZE_IN = (12.0, 7.6)
#: Most patches that are labelled.
MOST_NAMED = 40


def draw_covered(template: Template, strokes: Iterable[PaintMarks], path: Path, caption: str = "") -> None:
    """Draw what ``strokes`` of a covering tool have made of the template's areas to ``path`` (.svg or .png).

    Args:
        template: The template, with areas.
        strokes: Strokes of the tool.
        path: File to write.
        caption: The main figures.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
    cover(figure.add_subplot(), template, strokes, caption)
    with writing(path):
        figure.savefig(path, dpi=140)


def cover(axes: "Axes", template: Template, strokes: Iterable[PaintMarks], caption: str = "") -> None:
    """Draw what ``strokes`` of a covering tool have made of the template's areas into axes.

    Args:
        axes: Axes of matplotlib.
        template: The template, with areas.
        strokes: Strokes of the tool.
        caption: The main figures.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    from touchline.services.robot_sim.accounting.swept_ground import swept_ground
    from touchline.services.robot_sim.paint.ledger import PaintStroke

    drawn = [PaintStroke(np.column_stack((s.x_m, s.y_m)), s.width_m) for s in strokes if len(s.x_m) > 1]
    area = union([each.polygon for each in template.areas])
    swept, twice = swept_ground(drawn)
    missed = difference(area, swept)
    axes.set_facecolor(GROUND)
    for ground, colour, name in ((swept, COVERED, "covered"), (twice, TWICE, "twice"), (missed, MISSED, "missed")):
        fill_ground(axes, ground, colour, name)
    fill_ground(axes, union([_shape(each) for each in template.obstacles]), OBSTACLE, "obstacles")
    outline_ground(axes, area, AREA_EDGE, "-")
    if template.boundary is not None:
        outline_ground(axes, _shape(template.boundary), BOUNDARY, "--")
    _name_patches(axes, missed)
    kinds: list[Artist] = [Patch(color=COVERED, label="covered"), Patch(color=TWICE, label="more than once")]
    kinds += [Patch(color=MISSED, label="missed"), Line2D([], [], color=BOUNDARY, linestyle="--", label="boundary")]
    axes.legend(
        handles=kinds,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        borderaxespad=4.5,  # below the label of the axis, however high the axes are
        ncols=len(kinds),
        frameon=False,
        fontsize="small",
    )
    axes.set_aspect("equal")
    axes.margins(0.03)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_title(f"{plain(template.title or template.name, 200)}\n{caption}", fontsize="small")


def covered_caption(area: AreaReport) -> str:
    """Return a report's main figures as a caption."""
    return (
        f"covered {area.coverage_pct:.2f} % of the field, {area.of_reachable_pct:.2f} % of the reachable area, "
        f"{area.of_planned_pct:.2f} % of the plan; missed {area.missed_m2:.1f} m², twice {area.overlap_m2:.0f} m²; "
        f"body {100 * area.body_outside_m:.0f} cm outside"
    )


def _shape(polygon: Polygon) -> "BaseGeometry":
    import shapely

    return shapely.Polygon(polygon.corners)


def _name_patches(axes: "Axes", missed: "BaseGeometry") -> None:
    """Label each larger patch with its size, at most `MOST_NAMED` of them."""
    for patch in patches(missed)[:MOST_NAMED]:
        text, place = f"{patch.area_m2:.2f} m²", (patch.x_m, patch.y_m)
        axes.annotate(text, place, (3, 3), textcoords="offset points", color=MISSED, fontsize="x-small")
