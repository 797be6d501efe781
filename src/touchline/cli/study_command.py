"""``touchline study``: published studies reproduced, and compared with Touchline."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich import box
from rich.table import Table

from touchline.cli.coverage_study_output import coverage_study
from touchline.cli.display import print_line, print_table, progress_bar, say
from touchline.cli.network_study_output import network_study
from touchline.cli.obstacles_study_output import obstacles_study
from touchline.cli.options import ExitCode, JsonOption
from touchline.cli.reality_study_output import reality_study
from touchline.cli.study_output import StudyPlaces
from touchline.cli.tracking_study_output import tracking_study
from touchline.recordings.writing import writing
from touchline.schemas.errors import SpecError
from touchline.schemas.optional_packages import require

_PAIRS, _QUICK_PAIRS = 100, 20
_STYLES = {True: "green", False: "bold red", None: "dim"}


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("study")(study)


Subject = Literal["marking", "coverage", "tracking", "network", "obstacles", "reality"]


def study(
    subject: Annotated[
        Subject,
        typer.Argument(
            help="Study: line marking, covering a field with a roller, cubic paths and trajectory tracking, "
            "a network of robots, obstacles, or logs of real robots beside the emulator."
        ),
    ] = "marking",
    logs: Annotated[
        list[Path] | None, typer.Argument(metavar="[LOGS]", help="Reality: recordings or imported logs.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write the tables to this folder; marking: plots, too.")
    ] = None,
    pairs: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, max=10_000_000, help="Marking: number of random pose pairs (0: 100, as in the study)."
        ),
    ] = 0,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Smaller study. Marking: pitch only, a fifth of the pairs; coverage: one seed; tracking: few goals; "
            "network: ten robots for 40 s, one seed; obstacles: few lines and goals.",
        ),
    ] = False,
    seeds: Annotated[
        int, typer.Option(metavar="N", min=1, max=1000, help="Coverage, network, reality: number of seeds.")
    ] = 3,
    plots: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Tracking, network, obstacles: write pictures to this folder.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Reproduce a published study's benchmark and compare Touchline with it; exit code 1 if we miss a requirement."""
    require("touchline_research", "study")
    if logs and subject != "reality":
        raise SpecError("command line", "LOGS", f"is of no use for {subject}", "leave it out, or study reality")
    if subject == "reality":
        reality_study(logs or (), seeds, StudyPlaces(out, None), as_json=as_json)
        return
    if subject == "tracking":
        tracking_study(StudyPlaces(out, plots), quick=quick, as_json=as_json)
        return
    if subject == "network":
        network_study(seeds, StudyPlaces(out, plots), quick=quick, as_json=as_json)
        return
    if subject == "obstacles":
        obstacles_study(StudyPlaces(out, plots), quick=quick, as_json=as_json)
        return
    if subject == "coverage":
        coverage_study(1 if quick else seeds, out, as_json=as_json)
        return
    from touchline_research.run import run_study, save_study
    from touchline_research.table import CAUSE_HEADINGS, HEADINGS, with_total
    from touchline_research.table import as_json as json_text

    with progress_bar("Study") as advance:
        result = run_study(pairs or (_QUICK_PAIRS if quick else _PAIRS), quick, lambda what, done: advance(done, what))
    if out is not None:
        with writing(out, "folder"):
            files = save_study(result, out)
        say(f"wrote {', '.join(path.name for path in files)} to {out}")
    if as_json:
        typer.echo(json_text(result.rows, result.causes), nl=False)
    else:
        title = "The study's requirements, and what Touchline demands of itself in each"
        table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_lines=True)
        for heading in HEADINGS:
            table.add_column(heading)
        for row in result.rows:
            *cells, verdict = row.cells
            table.add_row(*cells, f"[{_STYLES[row.met]}]{verdict}[/]")
        gain = Table(title="The gain in time by its causes", title_justify="left", box=box.SIMPLE_HEAD)
        for heading in CAUSE_HEADINGS:
            gain.add_column(heading)
        for cause in with_total(result.causes):
            gain.add_row(*cause.cells)
        print_table(gain)
        print_table(table)
        for row in result.rows:
            if row.note:
                print_line(f"{row.number}: {row.note}")
    if any(row.met is False for row in result.rows):
        raise typer.Exit(ExitCode.FAILED)
