"""Judged tables on the terminal and in files, and the exit code that they ask for."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich import box
from rich.table import Table

from touchline.services.cli.display import output, say
from touchline.services.cli.options import ExitCode
from touchline.services.runs.writing import write_text, writing

if TYPE_CHECKING:
    from touchline.services.study.judged_table import JudgedTable

_STYLES = {True: "green", False: "bold red", None: "dim"}


def as_text(content: object) -> str:
    """JSON, as it is printed and written."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_tables(tables: "Sequence[JudgedTable]", text: str, folder: Path, stem: str) -> None:
    """Write the tables as Markdown, and `text` as JSON, to a folder."""
    with writing(folder, "folder"):
        folder.mkdir(parents=True, exist_ok=True)
    write_text("\n".join(table.markdown() for table in tables), folder / f"{stem}.md")
    write_text(text, folder / f"{stem}.json")
    say(f"wrote {stem}.md, {stem}.json to {folder}")


def print_tables(tables: "Sequence[JudgedTable]") -> None:
    """On the terminal, the verdicts in colour."""
    for judged in tables:
        table = Table(title=judged.title, title_justify="left", box=box.SIMPLE_HEAD, show_lines=True)
        for heading in judged.headings:
            table.add_column(heading)
        for row in judged.rows:
            *cells, verdict = row.texts
            table.add_row(*cells, f"[{_STYLES[row.met]}]{verdict}[/]")
        output().print(table)
        if judged.note:
            output().print(judged.note, highlight=False, markup=False)


def exit_if_missed(tables: "Sequence[JudgedTable]") -> None:
    """End with exit code 1 if a row misses what is asked of it."""
    if any(table.missed for table in tables):
        raise typer.Exit(ExitCode.FAILED)
