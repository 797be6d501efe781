"""``touchline study network``: teams by the study's rules and by ours, as tables, Markdown or JSON, and as pictures."""

from pathlib import Path

import typer

from touchline.schemas.setup import Setup
from touchline.schemas.team import TeamScenario
from touchline.services.cli.display import progress_bar, say
from touchline.services.cli.garbage import without_collecting
from touchline.services.cli.judged_output import as_text, exit_if_missed, print_tables, write_tables
from touchline.services.runs.writing import writing

STEM = "network-study"


def network_study(seeds: int, out: Path | None, plots: Path | None, *, quick: bool, as_json: bool) -> None:
    """Measure and print it; exit code 1 if something that is asked for is missed."""
    from touchline.services.robot_sim.warm_up import warm_up
    from touchline.services.study.network.network_figures import save_team_pictures
    from touchline.services.study.network.network_study import FULL, QUICK, run_network_study

    team = TeamScenario()
    with progress_bar("Study") as advance:
        warm_up(say, Setup(vehicle=team.vehicle, onboard=team.onboard))
        counts = QUICK if quick else FULL._replace(seeds=seeds)
        with without_collecting():
            study = run_network_study(counts, lambda what, done: advance(done, what))
    text = as_text([table.as_object() for table in study.tables])
    if out is not None:
        write_tables(study.tables, text, out, STEM)
    if plots is not None:
        with writing(plots, "folder"):
            pictures = save_team_pictures(study.deployed, plots)
        say(f"wrote {', '.join(path.name for path in pictures)} to {plots}")
    if as_json:
        typer.echo(text, nl=False)
    else:
        print_tables(study.tables)
    exit_if_missed(study.tables)
