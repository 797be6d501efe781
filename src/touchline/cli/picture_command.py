"""``touchline picture``: the work in a recording, drawn."""

from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.options import check_plot
from touchline.recordings.writing import check_writable


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("picture")(picture)


def picture(
    file: Annotated[Path, typer.Argument(metavar="RECORDING", help="Recording to draw (docs/guides/recordings.md).")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Picture to write: an .svg or .png file.")],
    robot: Annotated[
        str | None, typer.Option(metavar="NAME", help="Robot to draw, if the recording holds several (default: all).")
    ] = None,
) -> None:
    """Draw the work in a recording: its last traversal, or all of several robots.

    Paint is coloured by its distance from the template, or by robot if there are several; of covered areas gaps and
    overlaps are shown; of a team the paths of its robots.
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
