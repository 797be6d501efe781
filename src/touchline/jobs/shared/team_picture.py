"""Picture of the work of several robots: each in its own colour, with its planned path."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.jobs.shared.shared_job import SharedJob
from touchline.jobs.single.painted_picture import EDGE, FIGURE_SIZE_IN, GRASS
from touchline.jobs.single.recorded_paint import RecordedPaint
from touchline.recordings.writing import writing
from touchline.schemas.messages import PaintMarks
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Template
from touchline.services.planner.plots.ground import fill_ground, fill_obstacles, outline_ground

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

COLOURS: Final = ("#ffffff", "#ffd54a", "#7fd7ff", "#ff9e80", "#c5a3ff", "#b9f6ca", "#ff80ab", "#e0e0e0")


@dataclass(frozen=True)
class DrawnRobot:
    """Drawn items of a robot.

    Attributes:
        name: Name in the legend.
        strokes: Strokes of its tool.
        path: (n, 2) planned path, m, map frame, if known.
    """

    name: str
    strokes: Sequence[PaintMarks]
    path: NDArray[np.float64] | None = None


def draw_team(job: SharedJob, strokes: Sequence[Sequence[PaintMarks]], path: Path, caption: str) -> None:
    """Draw the work of each robot, and its planned path, to ``path`` (.svg or .png).

    Args:
        job: The job as first planned.
        strokes: Strokes of each robot's tool.
        path: File to write.
        caption: The main figures.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    robots = [
        DrawnRobot(f"r{number}, {job.table.ends_s[number - 1]:.0f} s", painted, timed.middles)
        for number, (timed, painted) in enumerate(zip(job.paths, strokes, strict=True), start=1)
    ]
    _draw(robots, [job.template], path, caption, covers=bool(job.template.areas))


def draw_recorded(recorded: Mapping[str, Sequence[RecordedPaint]], path: Path) -> None:
    """Draw the work of several robots in one recording, all traversals of each.

    Args:
        recorded: Paint of each robot, by name.
        path: File to write (.svg or .png).

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    robots = [DrawnRobot(name, [stroke for each in own for stroke in each.strokes]) for name, own in recorded.items()]
    shares = [own[0].template for own in recorded.values()]
    covers = any(each.covers for own in recorded.values() for each in own)
    _draw(robots, shares, path, f"{len(robots)} robots", covers=covers)


def _draw(robots: Sequence[DrawnRobot], shares: Sequence[Template], path: Path, caption: str, *, covers: bool) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
    axes = figure.add_subplot(facecolor=GRASS)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    for number, robot in enumerate(robots):
        colour = COLOURS[number % len(COLOURS)]
        if robot.path is not None:
            axes.plot(*robot.path.T, color=colour, linewidth=0.5, alpha=0.5)
            axes.plot(*robot.path[0], marker="o", markersize=5, color=colour, markeredgecolor=EDGE)
        axes.plot([], [], color=colour, linewidth=6.0 if covers else 2.2, label=robot.name)
        if covers:
            fill_ground(axes, _swept(robot.strokes), f"{colour}80", robot.name)
            continue
        for stroke in robot.strokes:
            axes.plot(stroke.x_m, stroke.y_m, color=colour, linewidth=2.2, solid_capstyle="butt")
    for area in (area for share in shares for area in share.areas):
        outline_ground(axes, area.polygon, EDGE, "-")
    fill_obstacles(axes, shares[0])
    axes.legend(loc="upper right", fontsize="small", facecolor=EDGE, labelcolor="white")
    axes.set_title(plain(shares[0].title or shares[0].name, 200), fontweight="bold", loc="left")
    axes.set_title(caption, fontsize="small", loc="right")
    with writing(path):
        figure.savefig(path, dpi=140)


def _swept(strokes: Iterable[PaintMarks]) -> "BaseGeometry":
    """Return the ground that a covering tool has swept."""
    from touchline.services.robot_sim.accounting.swept_ground import swept_ground
    from touchline.services.robot_sim.paint.ledger import PaintStroke

    drawn = [PaintStroke(np.column_stack((s.x_m, s.y_m)), s.width_m) for s in strokes if len(s.x_m) > 1]
    return swept_ground(drawn).swept
