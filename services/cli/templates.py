"""``touchline templates``: what can be painted out of the box."""

import json
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from schemas.template import load_template, shipped_templates, template_text
from services.cli.options import JsonOption


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("templates")(templates)


def templates(
    name: Annotated[str | None, typer.Argument(help="Print this template's JSON.", show_default=False)] = None,
    as_json: JsonOption = False,
) -> None:
    """List the shipped templates, or print one as JSON to start your own from."""
    if name is not None:
        text, _ = template_text(name)
        typer.echo(text.rstrip())
        return
    loaded = [load_template(path) for path in shipped_templates().values()]
    if as_json:
        rows = [
            {"name": t.name, "title": t.title, "segments": len(t.segments), "length_m": t.length_m, "source": t.source}
            for t in loaded
        ]
        typer.echo(json.dumps(rows, indent=2))
        return
    table = Table("name", "title", "segments", "line")
    for template in loaded:
        table.add_row(template.name, template.title, str(len(template.segments)), f"{template.length_m:.1f} m")
    Console().print(table)
