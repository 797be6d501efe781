"""``touchline calibrate``: constants of a robot from a recording of a drive."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from touchline.cli.display import print_event, print_figures, print_json, print_table, progress_bar
from touchline.cli.options import ExitCode, JsonOption, RecordedRobotOption, RecordingArgument
from touchline.schemas.messages import Event

if TYPE_CHECKING:
    from touchline.checking.calibrating.drive_calibration import Calibration


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("calibrate")(calibrate)


def calibrate(
    file: RecordingArgument,
    *,
    robot: RecordedRobotOption = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write vehicle.json and onboard.json with what was found to this folder."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find a robot's constants from a recorded drive: gyro scale, antenna, stamp offset, track width, side slip.

    What the drive does not tell has no number. Exit code 1, and no files, if nothing may be taken over.
    """
    from touchline.checking.calibrating.drive_calibration import calibrate as calibrated
    from touchline.checking.recorded_session import NotRebuilt
    from touchline.checking.spec_files import write_specs
    from touchline.schemas.errors import SpecError

    with progress_bar("Calibrate") as advance:
        try:
            found = calibrated(file, robot, lambda done: advance(done, ""))
        except NotRebuilt as error:
            raise SpecError(str(file), "", str(error), "record the sensors of the whole drive") from error
    if as_json:
        print_json(found.as_json())
    else:
        _print(file, found)
    if not found.believed:
        sys.exit(ExitCode.FAILED)
    if out is not None:
        for path in write_specs({"vehicle.json": found.setup.vehicle, "onboard.json": found.setup.onboard}, out):
            print_event(Event.INFO, f"written: {path}")


def _print(file: Path, found: "Calibration") -> None:
    table = Table("constant", "file", "found", "σ", "unit", "remark", title=f"Constants by {file}")
    for each in found.findings:
        told = not each.against and not found.doubts
        value, sigma = (f"{each.in_file + each.change:z.5f}", f"{each.sigma:.5f}") if told else ("", "")
        table.add_row(each.constant.name, f"{each.in_file:.5g}", value, sigma, each.constant.unit, each.against)
    print_table(table)
    noise = found.noise
    if noise.name:
        certain = "" if noise.told else f", or {noise.runner_up[0]}"
        changes = {
            f"{group}.{name}": value for group, values in noise.changes.items() for name, value in values.items()
        }
        print_figures(f"{noise.name} more than the files say{certain}", changes)
    for line in filter(None, (*found.doubts, found.not_told)):
        print_event(Event.WARN, line)
