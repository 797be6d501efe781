"""What every picture of the planner has in common: its ink, its type, and a file that is the same for the same plan."""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK = "#26332a"


def plan_style() -> AbstractContextManager[None]:
    """What is drawn in this context looks as pictures of plans do."""
    from matplotlib import rc_context

    return rc_context({"font.size": 9, "axes.edgecolor": INK})


def save(figure: "Figure", path: Path | str, dpi: int) -> None:
    """Write `figure` to `path`, without what would differ from one time to the next.

    Raises:
        ValueError: The file's ending names no known format.
        OSError: The file cannot be written.
    """
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": "touchline"}):
        figure.savefig(path, dpi=dpi, metadata={"Date": None} if str(path).endswith(".svg") else None)
