"""Tables of what was measured, where some rows must reach something: what is asked, and whether it is met."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field

VERDICTS = {True: "yes", False: "NO", None: ""}


@dataclass(frozen=True)
class JudgedRow:
    """One line of a table.

    Attributes:
        cells: What was measured, as text, the row's name first.
        must: What is asked for, in words; "" for information.
        met: Whether it is reached; None for information.
        figures: The figures behind the texts, by name.
    """

    cells: tuple[str, ...]
    must: str = ""
    met: bool | None = None
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def texts(self) -> tuple[str, ...]:
        """All cells, with what is asked and the verdict."""
        return (*self.cells, self.must, VERDICTS[self.met])


@dataclass(frozen=True)
class JudgedTable:
    """Rows under one title.

    Attributes:
        title: What is compared.
        columns: Headings of the rows' cells.
        rows: Each with as many cells.
        note: What a reader has to know.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[JudgedRow, ...]
    note: str = ""

    @property
    def headings(self) -> tuple[str, ...]:
        """Of all texts of a row."""
        return (*self.columns, "must", "met")

    @property
    def missed(self) -> bool:
        """True if a row misses what is asked of it."""
        return any(row.met is False for row in self.rows)

    def markdown(self) -> str:
        """Title, note and table."""
        lines = markdown_lines(self.headings, (row.texts for row in self.rows))
        return "\n\n".join(filter(None, (f"## {self.title}", self.note, "\n".join(lines)))) + "\n"

    def as_object(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def judged(asked: Sequence[tuple[str, bool]]) -> tuple[str, bool | None]:
    """`must` and `met` of a row of which several things are asked, each told in words and whether it is reached."""
    if not asked:
        return "", None
    return ", ".join(text for text, _ in asked), all(met for _, met in asked)


def markdown_lines(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table in Markdown, with bars in the texts as such."""
    lines = (headings, ["---"] * len(headings), *rows)
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |" for cells in lines]
