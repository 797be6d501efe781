"""Common style of the planner's plots, and files that are identical for identical plans."""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK = "#26332a"


def plan_style() -> AbstractContextManager[None]:
    """Context in which figures are drawn in the style of the planner's plots."""
    from matplotlib import rc_context

    return rc_context({"font.size": 9, "axes.edgecolor": INK})


def save(figure: "Figure", path: Path | str, dpi: int) -> None:
    """Write `figure` to `path`, without metadata that would differ from run to run.

    Raises:
        ValueError: The suffix names no known format.
        OSError: The file cannot be written.
    """
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": "touchline"}):
        figure.savefig(path, dpi=dpi, metadata={"Date": None} if str(path).endswith(".svg") else None)
