"""Output of studies: tables on the terminal and in files, and the exit code."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer
from rich import box
from rich.table import Table

from touchline.cli.display import print_line, print_table, say
from touchline.cli.options import ExitCode
from touchline.recordings.writing import write_text, writing

if TYPE_CHECKING:
    from touchline_research.target_table import TargetTable

_STYLES = {True: "green", False: "bold red", None: "dim"}


class StudyPlaces(NamedTuple):
    """Destinations of a study's files; None: not written.

    Attributes:
        out: Folder of its tables.
        plots: Folder of its pictures.
    """

    out: Path | None
    plots: Path | None


def as_text(content: object) -> str:
    """Return JSON as it is printed and written."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_tables(tables: "Sequence[TargetTable]", text: str, folder: Path, stem: str) -> None:
    """Write the tables as Markdown and `text` as JSON to a folder."""
    with writing(folder, "folder"):
        folder.mkdir(parents=True, exist_ok=True)
    write_text("\n".join(table.markdown() for table in tables), folder / f"{stem}.md")
    write_text(text, folder / f"{stem}.json")
    say(f"wrote {stem}.md, {stem}.json to {folder}")


def deliver_study(
    tables: "Sequence[TargetTable]",
    save_pictures: "Callable[[Path], Sequence[Path]]",
    places: StudyPlaces,
    stem: str,
    *,
    as_json: bool,
) -> None:
    """Write and print a study of several tables, with its pictures; exit code 1 if a row misses its requirement.

    Args:
        tables: The measured tables.
        save_pictures: Writes the pictures to a folder and returns their paths.
        places: Destinations of the files.
        stem: Stem of the files' names.
        as_json: Print JSON instead of tables.
    """
    text = as_text([table.as_object() for table in tables])
    if places.out is not None:
        write_tables(tables, text, places.out, stem)
    if places.plots is not None:
        with writing(places.plots, "folder"):
            pictures = save_pictures(places.plots)
        say(f"wrote {', '.join(path.name for path in pictures)} to {places.plots}")
    if as_json:
        typer.echo(text, nl=False)
    else:
        print_tables(tables)
    exit_if_missed(tables)


def print_tables(tables: "Sequence[TargetTable]") -> None:
    """Print the tables on the terminal, with the verdicts in colour."""
    for judged in tables:
        table = Table(title=judged.title, title_justify="left", box=box.SIMPLE_HEAD, show_lines=True)
        for heading in judged.headings:
            table.add_column(heading)
        for row in judged.rows:
            *cells, verdict = row.texts
            table.add_row(*cells, f"[{_STYLES[row.met]}]{verdict}[/]")
        print_table(table)
        if judged.note:
            print_line(judged.note)


def exit_if_missed(tables: "Sequence[TargetTable]") -> None:
    """End with exit code 1 if a row misses its requirement."""
    if any(table.missed for table in tables):
        raise typer.Exit(ExitCode.FAILED)
