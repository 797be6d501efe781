"""``touchline picture``: what a recording says was painted."""

from pathlib import Path
from typing import Annotated

import typer

from touchline.services.cli.options import check_plot
from touchline.services.runs.reports import paint_figures
from touchline.services.runs.writing import check_writable


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("picture")(picture)


def picture(
    file: Annotated[
        Path, typer.Argument(metavar="RECORDING", help="What to draw (docs/recording.md).", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The picture: an .svg or .png file.", show_default=False)],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", metavar="NAME", help="Of a recording of several robots, the one to draw.", show_default=False
        ),
    ] = None,
) -> None:
    """Draw what was painted in a recording (in its last traversal), coloured by its distance from the template."""
    from touchline.services.runs.painted_picture import draw_painted, painted_caption
    from touchline.services.runs.recorded_paint import read_painted

    check_plot(out, "--out")
    check_writable(out)
    session = read_painted(file, robot)
    caption = painted_caption(paint_figures(session.report)) if session.report else "not finished"
    draw_painted(session.template, session.strokes, out, caption, session.report.smears if session.report else ())
