"""``touchline study tracking``: cubic paths, speed laws and trackers, as tables, Markdown or JSON, and as pictures."""

from pathlib import Path

import typer

from touchline.services.cli.display import progress_bar, say
from touchline.services.cli.judged_output import as_text, exit_if_missed, print_tables, write_tables
from touchline.services.runs.writing import writing

STEM = "tracking-study"


def tracking_study(out: Path | None, plots: Path | None, *, quick: bool, as_json: bool) -> None:
    """Measure and print it; exit code 1 if something that is asked for is missed."""
    from touchline.services.study.tracking.tracking_figures import save_pictures
    from touchline.services.study.tracking.tracking_study import FULL, QUICK, run_tracking_study

    with progress_bar("Study") as advance:
        study = run_tracking_study(QUICK if quick else FULL, lambda what, done: advance(done, what))
    text = as_text([table.as_object() for table in study.tables])
    if out is not None:
        write_tables(study.tables, text, out, STEM)
    if plots is not None:
        with writing(plots, "folder"):
            pictures = save_pictures(study.domains, plots)
        say(f"wrote {', '.join(path.name for path in pictures)} to {plots}")
    if as_json:
        typer.echo(text, nl=False)
    else:
        print_tables(study.tables)
    exit_if_missed(study.tables)
