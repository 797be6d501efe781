"""Picture of the work of a traversal: paint, or covered areas."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from touchline.jobs.single.covered_picture import cover, covered_caption, draw_covered
from touchline.jobs.single.painted_picture import draw_painted, paint, painted_caption
from touchline.jobs.single.reports import paint_figures
from touchline.schemas.messages import AreaReport, PaintMarks, TraversalReport
from touchline.schemas.template import Template

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_work(
    template: Template, strokes: Iterable[PaintMarks], path: Path, report: TraversalReport, area: AreaReport | None
) -> None:
    """Draw ``strokes`` to ``path`` (.svg or .png), with the main figures.

    Args:
        template: The template of the traversal.
        strokes: Strokes of the tool.
        path: File to write.
        report: Report of the traversal.
        area: Report of its areas, if a covering tool has worked on some.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    if area is not None:
        draw_covered(template, strokes, path, covered_caption(area))
    else:
        draw_painted(template, strokes, path, painted_caption(paint_figures(report)), report.smears)


def draw_work_into(
    axes: "Axes",
    template: Template,
    strokes: Iterable[PaintMarks],
    report: TraversalReport,
    area: AreaReport | None,
) -> None:
    """Draw ``strokes`` into axes, with the main figures.

    Args:
        axes: Axes of matplotlib.
        template: The template of the traversal.
        strokes: Strokes of the tool.
        report: Report of the traversal.
        area: Report of its areas, if a covering tool has worked on some.
    """
    if area is not None:
        cover(axes, template, strokes, covered_caption(area))
    else:
        paint(axes, template, strokes, painted_caption(paint_figures(report)), report.smears)


def draw_unfinished(template: Template, strokes: Iterable[PaintMarks], path: Path, *, covers: bool) -> None:
    """Draw ``strokes`` of a traversal without a report yet; ``covers``: the tool does not paint.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    (draw_covered if covers else draw_painted)(template, strokes, path, "not finished")
