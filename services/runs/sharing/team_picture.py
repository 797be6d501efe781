"""A picture of what several robots have done together: each in a colour of its own, with the way it had planned."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.schemas.messages import PaintMarks
from touchline.schemas.plain_text import plain
from touchline.services.planner.plots.ground import fill_ground, outline_ground
from touchline.services.runs.painted_picture import EDGE, FIGURE_SIZE_IN, GRASS
from touchline.services.runs.sharing.shared_job import SharedJob
from touchline.services.runs.writing import writing

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

COLOURS: Final = ("#ffffff", "#ffd54a", "#7fd7ff", "#ff9e80", "#c5a3ff", "#b9f6ca", "#ff80ab", "#e0e0e0")


def draw_team(job: SharedJob, strokes: Sequence[Sequence[PaintMarks]], path: Path, caption: str) -> None:
    """Draw the work of each robot, and its planned way, to ``path`` (.svg or .png).

    Args:
        job: As it was planned at first.
        strokes: Of the tool of each robot.
        path: Where to.
        caption: The figures that say most.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
    axes = figure.add_subplot(facecolor=GRASS)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    for number, (way, painted) in enumerate(zip(job.paths, strokes, strict=True)):
        colour, name = COLOURS[number % len(COLOURS)], f"r{number + 1}, {job.table.ends_s[number]:.0f} s"
        axes.plot(*way.middles.T, color=colour, linewidth=0.5, alpha=0.5)
        axes.plot(*way.middles[0], marker="o", markersize=5, color=colour, markeredgecolor=EDGE)
        if job.template.areas:
            axes.plot([], [], color=colour, linewidth=6.0, label=name)
            fill_ground(axes, _swept(painted), f"{colour}80", name)
            continue
        for index, stroke in enumerate(painted):
            label = name if index == 0 else None
            axes.plot(stroke.x_m, stroke.y_m, color=colour, linewidth=2.2, solid_capstyle="butt", label=label)
    for area in job.template.areas:
        outline_ground(axes, area.polygon, EDGE, "-")
    axes.legend(loc="upper right", fontsize="small", facecolor=EDGE, labelcolor="white")
    axes.set_title(plain(job.template.title or job.template.name, 200), fontweight="bold", loc="left")
    axes.set_title(caption, fontsize="small", loc="right")
    with writing(path):
        figure.savefig(path, dpi=140)


def _swept(strokes: Iterable[PaintMarks]) -> "BaseGeometry":
    """What a covering tool has been over."""
    from touchline.services.robot_sim.accounting.swept_ground import swept_ground
    from touchline.services.robot_sim.paint.ledger import PaintStroke

    drawn = [PaintStroke(np.column_stack((s.x_m, s.y_m)), s.width_m) for s in strokes if len(s.x_m) > 1]
    return swept_ground(drawn).swept
