"""Work of all drives of a job, against its template."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Protocol

from touchline.schemas.messages import PaintMarks


class WorkDone(Protocol):
    """True work of all drives, and what is left undone."""

    @property
    def refusal(self) -> str:
        """Why the work is not accepted; "" if it is."""

    def figures(self) -> dict[str, Any]:
        """Return the work, and what is left undone, as figures of a report."""

    def warnings(self) -> Iterator[str]:
        """Yield what is left undone, and the plan of the whole job does not leave out."""

    def draw(self, strokes: Iterable[PaintMarks], path: Path) -> None:
        """Draw the work of all drives, and what is left undone, to a file (.svg or .png).

        Args:
            strokes: True strokes of all drives.
            path: File to write.

        Raises:
            SpecError: The file cannot be written.
            ValueError: The file's ending names no known format.
        """
