"""The study's table as measured: rows of requirements with every planner's result, and how it is written down."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from services.planner.study.drive import CONTESTANTS

NAMES = tuple(contestant.name for contestant in CONTESTANTS)
HEADINGS = ("row", "requirement", *NAMES, "ours must", "met")


@dataclass(frozen=True)
class Row:
    """One requirement.

    Attributes:
        number: Of the reference table, with a letter where it has several targets.
        requirement: What is asked.
        results: The planners' results as text, in the order of `NAMES`.
        must: What ours must reach; empty if the row is for information.
        met: Whether it does; None if the row is for information.
        figures: The figures behind the texts, by name.
        note: What a reader has to know.
    """

    number: str
    requirement: str
    results: tuple[str, str, str]
    must: str
    met: bool | None
    figures: Mapping[str, float | int | bool | None] = field(default_factory=dict)
    note: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """The row as texts under `HEADINGS`."""
        return (self.number, self.requirement, *self.results, self.must, verdict(self.met))


def of_each(texts: Iterable[str]) -> tuple[str, str, str]:
    """The planners' results, one for each of `NAMES`."""
    first, second, third = texts
    return first, second, third


def verdict(met: bool | None) -> str:
    """Pass, FAIL, or a dash for a row without a target."""
    return "–" if met is None else "pass" if met else "FAIL"


def as_markdown(rows: Sequence[Row]) -> str:
    """A table, and the notes below it."""
    lines = ["| " + " | ".join(HEADINGS) + " |", "| " + " | ".join("---" for _ in HEADINGS) + " |"]
    lines += ["| " + " | ".join(row.cells) + " |" for row in rows]
    notes = [f"- **{row.number}**: {row.note}" for row in rows if row.note]
    return "\n".join([*lines, "", *notes]) + "\n"


def as_csv(rows: Sequence[Row]) -> str:
    """The table's texts."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADINGS)
    writer.writerows(row.cells for row in rows)
    return text.getvalue()


def as_json(rows: Sequence[Row]) -> str:
    """Everything, figures included."""
    return json.dumps({"rows": [as_object(row) for row in rows]}, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def as_object(row: Row) -> dict[str, object]:
    """One row as a JSON object."""
    return {
        "row": row.number,
        "requirement": row.requirement,
        **dict(zip(NAMES, row.results, strict=True)),
        "ours must": row.must,
        "met": row.met,
        "figures": dict(row.figures),
        "note": row.note,
    }
