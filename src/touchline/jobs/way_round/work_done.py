"""Work of all drives of a job, against its template."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from touchline.recordings.writing import writing
from touchline.schemas.messages import AreaReport, PaintMarks, TraversalReport

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURE_SIZE_IN: Final = (12.0, 7.6)


class WorkDone(Protocol):
    """True work of all drives, and what is left undone."""

    @property
    def report(self) -> TraversalReport:
        """Report of the work, without times."""

    @property
    def area(self) -> AreaReport | None:
        """Report of the areas, if a covering tool has worked on some."""

    @property
    def refusal(self) -> str:
        """Reason why the work is not accepted; "" if it is."""

    def figures(self) -> dict[str, Any]:
        """Return the work, and what is left undone, as figures of a report."""

    def warnings(self) -> Iterator[str]:
        """Yield what is left undone, and the plan of the whole job does not leave out."""

    def draw_into(self, axes: "Axes", strokes: Iterable[PaintMarks]) -> None:
        """Draw the work of all drives, and what is left undone.

        Args:
            axes: Axes of matplotlib.
            strokes: True strokes of all drives.
        """


def draw_work_done(work: WorkDone, strokes: Iterable[PaintMarks], path: Path) -> None:
    """Draw the work of all drives, and what is left undone, to a file (.svg or .png).

    Args:
        work: The work.
        strokes: True strokes of all drives.
        path: File to write.

    Raises:
        SpecError: The file cannot be written.
        ValueError: The file's ending names no known format.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=FIGURE_SIZE_IN, layout="constrained")
    work.draw_into(figure.add_subplot(), strokes)
    with writing(path):
        figure.savefig(path, dpi=140)
