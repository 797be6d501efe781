"""``touchline picture``: what a recording says was painted or covered."""

from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.options import check_plot
from touchline.recordings.writing import check_writable


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
            "--robot",
            metavar="NAME",
            help="Of a recording of several robots, the one to draw; else all together.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Draw what was done in a recording: in its last traversal, or in all of several robots.

    Paint is coloured by its distance from the template, or by the robot if there are several; of areas that were
    covered, gaps and overlaps are shown; of a team the ways of its robots.
    """
    from touchline.jobs.shared.team_picture import draw_recorded
    from touchline.jobs.single.recorded_paint import read_all_painted
    from touchline.jobs.single.work_picture import draw_unfinished, draw_work
    from touchline.jobs.team.recorded_team import draw_team, is_team, read_team

    check_plot(out, "--out")
    check_writable(out)
    if is_team(file):
        draw_team(read_team(file), out, robot)
        return
    recorded = read_all_painted(file, robot)
    if len(recorded) > 1:
        draw_recorded(recorded, out)
        return
    ((*_, session),) = recorded.values()
    if session.report is not None:
        draw_work(session.template, session.strokes, out, session.report, session.area)
    else:
        draw_unfinished(session.template, session.strokes, out, covers=session.covers)
