"""Output of the subcommands: results on standard output, progress and events on standard error.

On a terminal tables are drawn and progress is a bar. In a pipe or a file a table is one line per row with tabs between
the cells, and progress is an occasional line. `quiet` leaves only results, warnings and errors.
"""

import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from touchline.core.compilations import Compilations
from touchline.schemas.messages import Event, LeftOutStretch, PlanReport
from touchline.schemas.plain_text import plain, plain_lines
from touchline.schemas.supplies import full
from touchline.schemas.vehicles import Vehicle

#: Progress and events go to standard error, so that standard output holds only the result.
stderr = Console(stderr=True, highlight=False)

Advance = Callable[[float, str], None]

_SEVERITY = {Event.INFO: ("info", "cyan"), Event.WARN: ("warning", "yellow"), Event.ERROR: ("error", "red")}
_DIGITS = 4
_LONGEST_DETAIL = 200
#: Time between two lines of progress without a terminal.
_LINE_EVERY_S: Final = 10.0


class Verbosity:
    """Amount and destination of the output; set once, by the options of the subcommand.

    Attributes:
        quiet: Only warnings and errors go to standard error.
        verbose: Errors come with their tracebacks, and with information: 1; with everything that is logged: 2.
        output_taken: Standard output carries a file requested as `-`; figures go to standard error.
    """

    quiet = False
    verbose = 0
    output_taken = False


@contextmanager
def progress_bar(title: str) -> Iterator[Advance]:
    """Show progress, and compilations, on standard error; call the yielded function with a fraction 0…1 and a text."""
    begun_s = time.monotonic()
    with Compilations(lambda name: say(f"compiling {name}")) as compiled:
        if Verbosity.quiet:
            yield lambda fraction, detail: None
        elif stderr.is_terminal:
            yield from _bar(title)
        else:
            yield _lines(title)
    if compiled.names:
        say(f"compiled {len(compiled.names)} kernels; {time.monotonic() - begun_s:.1f} s in all")


def _bar(title: str) -> Iterator[Advance]:
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


def _lines(title: str) -> Advance:
    """Print progress every few seconds; nothing for tasks that take less."""
    begun_s = shown_s = time.monotonic()

    def advance(fraction: float, detail: str) -> None:
        nonlocal shown_s
        now_s = time.monotonic()
        if now_s - shown_s >= _LINE_EVERY_S:
            shown_s = now_s
            say(f"{title}: {fraction:.0%} after {now_s - begun_s:.0f} s  {plain(detail, _LONGEST_DETAIL)}".rstrip())

    return advance


def print_line(text: str) -> None:
    """Print a line of the result, with control sequences removed."""
    _print(plain_lines(text))


def print_json(content: object, indent: int | None = 2) -> None:
    """Print the result as JSON."""
    _print(json.dumps(content, indent=indent, ensure_ascii=False))


def print_table(table: Table) -> None:
    """Print a table: drawn on a terminal, else title, headings and a line per row with tabs between cells."""
    if sys.stdout.isatty() and not Verbosity.output_taken:
        Console(highlight=False).print(table)
        return
    if table.title:
        _print(_plain_cell(table.title))
    columns = [[_plain_cell(cell) for cell in column.cells] for column in table.columns]
    headings = [_plain_cell(column.header) for column in table.columns]
    rows = zip(*columns, strict=True)
    for row in (headings, *rows) if table.show_header else rows:
        _print("\t".join(row).rstrip())


def _print(text: str) -> None:
    typer.echo(text, err=Verbosity.output_taken)


def _plain_cell(cell: object) -> str:
    """Return a cell's text on one line, without markup."""
    return " ".join(Text.from_markup(str(cell)).plain.split())


def say(text: str) -> None:
    """Print lines on standard error, with control sequences removed."""
    if not Verbosity.quiet:
        stderr.print(plain_lines(text), markup=False, soft_wrap=True)


def print_event(severity: int, text: str) -> None:
    """Print one line on standard error, labelled with its severity."""
    if Verbosity.quiet and severity == Event.INFO:
        return
    word, style = _SEVERITY[severity]
    stderr.print(f"[{style}]{word:>8}[/] ", escape(plain(text)), sep="", markup=True, soft_wrap=True)


def warn_of_shortages(report: PlanReport, vehicle: Vehicle) -> None:
    """Warn on standard error if a full tank or a full battery does not last for the plan."""
    for shortage in full(report, vehicle).shortages:
        print_event(Event.WARN, f"the job {shortage}")


def warn_of_left_out(stretches: Iterable[LeftOutStretch]) -> None:
    """Warn on standard error of each stretch of a line that the plan leaves out."""
    for stretch in stretches:
        print_event(Event.WARN, f"the plan leaves out {stretch.words}")


def warn_of_undone(warnings: Iterable[str]) -> None:
    """Warn on standard error of what a robot has left undone."""
    for warning in warnings:
        print_event(Event.WARN, warning)


def print_figures(title: str, figures: Mapping[str, Any]) -> None:
    """Print a report as a table, one figure per line, named as in its JSON form."""
    table = Table(title=escape(plain(title)), title_justify="left", show_header=False, box=None, padding=(0, 2))
    table.add_column()
    table.add_column()
    for name, value in _flatten(figures):
        table.add_row(escape(plain(name)), escape(plain(_shown(value))))
    print_table(table)


def _flatten(figures: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in figures.items():
        path = f"{prefix}{name}"
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{path}.")
        elif not isinstance(value, list):  # nested tables are in the JSON report only
            yield path, value


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{_DIGITS}g}" if abs(value) < 10**_DIGITS else f"{value:,.1f}"
    return f"{value:,}" if isinstance(value, int) else "–" if value is None or value == "" else str(value)
