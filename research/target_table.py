"""Tables of measurements, with targets for some rows and whether they are met."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field

VERDICTS = {True: "yes", False: "NO", None: ""}


@dataclass(frozen=True)
class TargetRow:
    """One line of a table.

    Attributes:
        cells: Name of the row, and measurements as text.
        must: Targets in words; "" for information.
        met: Whether they are met; None for information.
        figures: Numbers behind the texts, by name.
    """

    cells: tuple[str, ...]
    must: str = ""
    met: bool | None = None
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def texts(self) -> tuple[str, ...]:
        """All cells, with targets and verdict."""
        return (*self.cells, self.must, VERDICTS[self.met])


@dataclass(frozen=True)
class TargetTable:
    """Rows under one title.

    Attributes:
        title: Title of the comparison.
        columns: Headings of the rows' cells.
        rows: Rows, each with as many cells.
        note: Remark for the reader.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[TargetRow, ...]
    note: str = ""

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of all texts of a row."""
        return (*self.columns, "must", "met")

    @property
    def missed(self) -> bool:
        """True if a row misses a target."""
        return any(row.met is False for row in self.rows)

    def markdown(self) -> str:
        """Title, note and table in Markdown."""
        lines = markdown_lines(self.headings, (row.texts for row in self.rows))
        return "\n\n".join(filter(None, (f"## {self.title}", self.note, "\n".join(lines)))) + "\n"

    def as_object(self) -> dict[str, object]:
        """Table as an object for JSON."""
        return asdict(self)


def against_targets(asked: Sequence[tuple[str, bool]]) -> tuple[str, bool | None]:
    """Combine targets, each with its text and whether it is met, to `must` and `met` of a row."""
    if not asked:
        return "", None
    return ", ".join(text for text, _ in asked), all(met for _, met in asked)


def markdown_lines(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Format a table in Markdown; bars in the texts are escaped."""
    lines = (headings, ["---"] * len(headings), *rows)
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |" for cells in lines]
