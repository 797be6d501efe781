"""``touchline fit``: the scenario that errs as a log does."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from touchline.cli.display import print_event, print_json, print_table, progress_bar
from touchline.cli.options import JsonOption, RecordedRobotOption, RecordingArgument
from touchline.schemas.messages import Event

_SEEDS = 3

if TYPE_CHECKING:
    from touchline.checking.reality.emulator_beside import EmulatedStatistic
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

    Prints the log's statistics, and those of three emulations with that scenario; one that the log does not tell has no
    number, and its cause stays as by default. Warns of those that the emulator does not have within 15 %.
    """
    from touchline.checking.reality.emulator_beside import all_beside
    from touchline.checking.reality.log_fit import fit_log
    from touchline.checking.spec_files import write_specs

    with progress_bar("Fit") as advance:
        log, found = fit_log(file, robot, lambda done: advance(0.5 * done, "fitting"))
        beside = all_beside(log, found, _SEEDS, lambda done: advance(0.5 + 0.5 * done, "emulating"))
    if as_json:
        statistics = {key: {**told._asdict(), **_emulated(beside.get(key))} for key, told in found.statistics.items()}
        scenario = found.scenario.model_dump(mode="json", exclude_defaults=True)
        onboard = found.onboard.model_dump(mode="json", exclude_defaults=True)
        print_json({"statistics": statistics, "scenario": scenario, "onboard": onboard})
    else:
        _print(file, found, beside)
    for line in off_lines(beside):
        print_event(Event.WARN, line)
    if out is not None:
        for path in write_specs({"scenario.json": found.scenario, "onboard.json": found.onboard}, out):
            print_event(Event.INFO, f"written: {path}")


def _emulated(beside: "EmulatedStatistic | None") -> dict[str, float | bool | None]:
    """Return what JSON has of the emulator."""
    if beside is None:
        return {"emulated": None, "met": None}
    return {"emulated": beside.mean if beside.values else None, "met": beside.met}


def off_lines(beside: Mapping[str, "EmulatedStatistic"]) -> list[str]:
    """Return a line for each statistic of the log that the emulator does not have."""
    from touchline.checking.reality.log_statistics import MEANINGS

    lines = []
    for key, each in beside.items():
        if not each.met:
            how = f"differs by {100.0 * each.off:+.0f} %" if not each.untold else f"does not tell it: {each.untold}"
            lines.append(f"{MEANINGS[key].name}: the emulator with this scenario {how}")
    return lines


def _print(file: Path, found: "ScenarioFit", beside: Mapping[str, "EmulatedStatistic"]) -> None:
    from touchline.checking.reality.log_statistics import MEANINGS

    table = Table("statistic", "log", "emulator", "unit", "why the log does not tell it", title=f"Errors of {file}")
    for key, told in found.statistics.items():
        meaning, emulator = MEANINGS[key], beside.get(key)
        value = "" if told.value is None else f"{told.value * meaning.scale:.3g}"
        also = f"{emulator.mean * meaning.scale:.3g}" if emulator is not None and emulator.values else ""
        table.add_row(meaning.name, value, also, meaning.unit, told.untold)
    print_table(table)
