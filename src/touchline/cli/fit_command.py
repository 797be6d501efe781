"""``touchline fit``: the scenario that errs as a log does."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from touchline.cli.display import print_event, print_json, print_table, progress_bar
from touchline.cli.options import JsonOption, RecordedRobotOption, RecordingArgument
from touchline.schemas.messages import Event

if TYPE_CHECKING:
    from touchline.checking.reality.scenario_fit import ScenarioFit


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("fit")(fit)


def fit(
    file: RecordingArgument,
    *,
    robot: RecordedRobotOption = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write scenario.json and onboard.json to this folder."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the scenario whose emulated robot errs as a log's robot does, and a computer that knows its noise.

    Prints the log's statistics; one that the log does not tell has no number, and its cause stays as by default.
    """
    from touchline.checking.reality.log_fit import fit_log
    from touchline.checking.spec_files import write_specs

    with progress_bar("Fit") as advance:
        _, found = fit_log(file, robot, lambda done: advance(done, ""))
    if as_json:
        statistics = {key: told._asdict() for key, told in found.statistics.items()}
        scenario = found.scenario.model_dump(mode="json", exclude_defaults=True)
        onboard = found.onboard.model_dump(mode="json", exclude_defaults=True)
        print_json({"statistics": statistics, "scenario": scenario, "onboard": onboard})
    else:
        _print(file, found)
    if out is not None:
        for path in write_specs({"scenario.json": found.scenario, "onboard.json": found.onboard}, out):
            print_event(Event.INFO, f"written: {path}")


def _print(file: Path, found: "ScenarioFit") -> None:
    from touchline.checking.reality.log_statistics import MEANINGS

    table = Table("statistic", "log", "unit", "why the log does not tell it", title=f"Errors of {file}")
    for key, told in found.statistics.items():
        meaning = MEANINGS[key]
        value = "" if told.value is None else f"{told.value * meaning.scale:.3g}"
        table.add_row(meaning.name, value, meaning.unit, told.untold)
    print_table(table)
