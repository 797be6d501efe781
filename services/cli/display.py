"""What the subcommands show: progress bars, figures as tables, and events."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from touchline.schemas.messages import Event, PlanReport
from touchline.schemas.plain_text import plain, plain_lines
from touchline.schemas.supplies import full
from touchline.schemas.vehicles import Vehicle

#: Progress and events go to standard error, so that standard output holds nothing but the result.
stderr = Console(stderr=True, highlight=False)

#: Columns where nobody's terminal says how many there are: a table that is piped is never wrapped.
_PIPED_COLUMNS = 1000

Advance = Callable[[float, str], None]

_SEVERITY = {Event.INFO: ("info", "cyan"), Event.WARN: ("warning", "yellow"), Event.ERROR: ("error", "red")}
_DIGITS = 4
_LONGEST_DETAIL = 200


@contextmanager
def progress_bar(title: str) -> Iterator[Advance]:
    """A bar on standard error; call what it gives with a fraction 0…1 and a text."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[detail]}", markup=False),
        console=stderr,
        transient=True,
    ) as progress:
        task = progress.add_task(title, total=1.0, detail="")
        yield lambda fraction, detail: progress.update(task, completed=fraction, detail=plain(detail, _LONGEST_DETAIL))


def output() -> Console:
    """Standard output, for tables: as wide as the terminal, or as what is printed where there is none."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _PIPED_COLUMNS)


def say(text: str) -> None:
    """A line or several on standard error, whoever wrote it: nothing in it commands the terminal."""
    stderr.print(plain_lines(text), markup=False, soft_wrap=True)


def print_event(severity: int, text: str) -> None:
    """One line on standard error."""
    word, style = _SEVERITY[severity]
    stderr.print(f"[{style}]{word:>8}[/] ", escape(plain(text)), sep="", markup=True, soft_wrap=True)


def warn_of_shortages(report: PlanReport, vehicle: Vehicle) -> None:
    """A line on standard error for a full tank and for a full battery if it will not last for the plan."""
    for shortage in full(report, vehicle).shortages:
        print_event(Event.WARN, f"the job {shortage}")


def print_figures(title: str, figures: Mapping[str, Any]) -> None:
    """A report as a table, a line a figure, named as in its JSON form."""
    table = Table(title=escape(plain(title)), title_justify="left", show_header=False, box=None, padding=(0, 2))
    for name, value in _flatten(figures):
        table.add_row(escape(plain(name)), escape(plain(_shown(value))))
    output().print(table)


def _flatten(figures: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in figures.items():
        path = f"{prefix}{name}"
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{path}.")
        elif not isinstance(value, list):  # a table in a table: the JSON report has it
            yield path, value


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{_DIGITS}g}" if abs(value) < 10**_DIGITS else f"{value:,.1f}"
    return f"{value:,}" if isinstance(value, int) else "–" if value is None or value == "" else str(value)
