"""Table of the study as measured: rows of requirements with every planner's result, and its formats."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field

from touchline_research.driven_template import CONTESTANTS
from touchline_research.target_table import markdown_lines

NAMES = tuple(contestant.name for contestant in CONTESTANTS)
HEADINGS = ("row", "requirement", *NAMES, "ours must", "met")


@dataclass(frozen=True)
class Row:
    """Requirement of the study, with results.

    Attributes:
        number: Number in the reference table, with a letter where it has several targets.
        requirement: Requirement in words.
        results: Results of the planners as text, in the order of `NAMES`.
        must: Target of ours; empty if the row is for information.
        met: Whether it is met; None if the row is for information.
        figures: Numbers behind the texts, by name.
        note: Remark for the reader.
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
        """Texts of the row under `HEADINGS`."""
        return (self.number, self.requirement, *self.results, self.must, verdict(self.met))


CAUSE_HEADINGS = ("exchanged", "before", "after", "gain", "of DPP's time")


@dataclass(frozen=True)
class Cause:
    """Gain by one difference between DPP and ours: seconds before and after it is exchanged.

    Attributes:
        exchanged: Difference in words.
        before_s, after_s: Seconds before and after the exchange.
        first_s: Seconds before anything was exchanged.
    """

    exchanged: str
    before_s: float
    after_s: float
    first_s: float

    @property
    def share(self) -> float:
        """Gain relative to the time before anything was exchanged; the shares of all causes add up."""
        return (self.after_s - self.before_s) / self.first_s

    @property
    def cells(self) -> tuple[str, ...]:
        """Texts of the cause under `CAUSE_HEADINGS`."""
        gain = self.after_s - self.before_s
        return (
            self.exchanged,
            f"{self.before_s:.1f} s",
            f"{self.after_s:.1f} s",
            f"{gain:+.1f} s",
            f"{self.share:+.1%}",
        )


def with_total(causes: Sequence[Cause]) -> list[Cause]:
    """Append the total of the causes."""
    first, last = causes[0].before_s, causes[-1].after_s
    return [*causes, Cause("all together", first, last, first)]


def of_each(texts: Iterable[str]) -> tuple[str, str, str]:
    """Collect the planners' results, one for each of `NAMES`."""
    first, second, third = texts
    return first, second, third


def verdict(met: bool | None) -> str:
    """Return pass, FAIL, or a dash for a row without a target."""
    return "–" if met is None else "pass" if met else "FAIL"


def as_markdown(rows: Sequence[Row], causes: Sequence[Cause]) -> str:
    """Format the gain by its causes, the table of all rows, and the notes below it in Markdown."""
    parts = [markdown_lines(CAUSE_HEADINGS, [cause.cells for cause in with_total(causes)])]
    parts.append(markdown_lines(HEADINGS, [row.cells for row in rows]))
    parts.append([f"- **{row.number}**: {row.note}" for row in rows if row.note])
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def as_csv(rows: Sequence[Row]) -> str:
    """Format the texts of the rows as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADINGS)
    writer.writerows(row.cells for row in rows)
    return text.getvalue()


def as_json(rows: Sequence[Row], causes: Sequence[Cause]) -> str:
    """Format rows and causes, figures included, as JSON."""
    whole = {"causes": [asdict(cause) for cause in causes], "rows": [as_object(row) for row in rows]}
    return json.dumps(whole, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def as_object(row: Row) -> dict[str, object]:
    """Convert a row to an object for JSON."""
    return {
        "row": row.number,
        "requirement": row.requirement,
        **dict(zip(NAMES, row.results, strict=True)),
        "ours must": row.must,
        "met": row.met,
        "figures": dict(row.figures),
        "note": row.note,
    }
