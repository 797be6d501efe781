"""``touchline calibrate``: constants of a robot from a drive, which it does for that, or which has been recorded."""

import math
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from touchline.cli.choices import SetupChoice, check_follower
from touchline.cli.display import print_event, print_figures, print_json, print_table, progress_bar
from touchline.cli.groups import with_groups
from touchline.cli.job_terminal import Terminal
from touchline.cli.number_list import numbers_of
from touchline.cli.options import ExitCode, JsonOption, check_plot, config_of, refuse_options, speed_factor
from touchline.jobs.watcher import JobFailed
from touchline.recordings.writing import check_recordable, check_writable
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import Event, PlanOptions
from touchline.schemas.vehicles import Vehicle

if TYPE_CHECKING:
    from touchline.bus import BusConfig
    from touchline.checking.calibrating.drive_calibration import Calibration
    from touchline.schemas.setup import Setup
    from touchline.services.planner.calibration_drive import CalibrationDrive

_RECORD = Path("calibration.mcap")


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("calibrate")(with_groups(calibrate))


@dataclass(frozen=True)
class DriveChoice:
    """Options of the calibration drive."""

    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,HEADING", help="Start pose of the drive (m, m, rad; default: the scenario's, or 0,0,0)."
        ),
    ] = None
    field: Annotated[
        str | None,
        typer.Option(metavar="TEMPLATE|MAP.yaml", help="Refuse a drive beyond its boundary or over its obstacles."),
    ] = None
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE.mcap", help=f"Record the drive to this file (default: {_RECORD})."),
    ] = None
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the plan of the drive to this file (.svg, .png).")
    ] = None
    speed: Annotated[
        str | None,
        typer.Option(metavar="FACTOR", help="Pace of an emulated robot on the bus, × real time (default: 1)."),
    ] = None

    @property
    def recording(self) -> Path:
        """File to record to."""
        return self.record or _RECORD

    def planned(self, vehicle: Vehicle, standing: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> "CalibrationDrive":
        """Return the planned drive, from --start or else from where the robot is standing.

        Raises:
            PlanningError: The vehicle cannot be calibrated, or the ground is not free.
            SpecError: An option is not usable.
        """
        from touchline.services.planner.calibration_drive import plan_calibration
        from touchline.services.planner.plots.way_picture import plot_way

        x_m, y_m, heading_rad = numbers_of("--start", self.start, (3,), "0,0,0") if self.start else standing
        ground = self._ground()
        drive = plan_calibration(vehicle, (x_m, y_m, heading_rad), ground)
        print_event(Event.INFO, f"the drive takes {drive.time_s:.0f} s and needs {drive.space}")
        if self.plot is not None:
            plot_way(drive.plan, ground, vehicle, self.plot)
        return drive

    def _ground(self) -> KnownGround:
        if self.field is None:
            return OPEN_GROUND
        from touchline.jobs.goal.known_field import load_ground

        return load_ground(self.field)

    def check(self) -> None:
        """Refuse options that cannot be used, before any work is done.

        Raises:
            SpecError: A file cannot be written, or the pace is none.
        """
        check_recordable(self.recording)
        check_writable(self.plot)
        check_plot(self.plot)
        speed_factor(self.speed or "1")

    def refuse(self, problem: str, remedy: str) -> None:
        """Refuse these options.

        Raises:
            SpecError: One of them is given.
        """
        refuse_options(self, problem, remedy)


def calibrate(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RECORDING]", help="A recorded drive; without it the robot does one for that.", show_default=False
        ),
    ] = None,
    *,
    robot: SetupChoice,
    drive: DriveChoice,
    name: Annotated[
        str | None,
        typer.Option("--robot", metavar="NAME", help="Robot on the bus, or the one to use of several in a recording."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write vehicle.json and onboard.json with what was found to this folder."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find a robot's constants from a drive: gyro scale, antenna, stamp offset, track width, side slip.

    The robot does the drive, with --vehicle an emulated one in this process, without it the one on the bus; or a
    recording of a drive is given. What the drive does not tell has no number. Exit code 1, and no files, if nothing may
    be taken over.
    """
    from touchline.checking.calibrating.drive_calibration import calibrate as calibrated
    from touchline.checking.recorded_session import NotRebuilt
    from touchline.checking.spec_files import write_specs

    if file is None:
        file, namespace = _driven(robot, drive, name), None
    else:
        problem, remedy = "but a recording is given", "leave it out, or leave out the recording"
        robot.refuse(problem, remedy)
        drive.refuse(problem, remedy)
        namespace = name
    with progress_bar("Calibrate") as advance:
        try:
            found = calibrated(file, namespace, lambda done: advance(done, ""))
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


def _driven(robot: SetupChoice, drive: DriveChoice, name: str | None) -> Path:
    """Have a robot do the calibration drive; return its recording."""
    drive.check()
    if robot.vehicle is None:
        robot.refuse("but the robot on the bus has its own", "leave it out, or give --vehicle")
        problem = _driven_on_bus(config_of(name), drive)
    elif name is not None:
        raise SpecError("command line", "--robot", f"is {name}, and --vehicle is given, too", "give one of them")
    elif drive.speed is not None:
        remedy = "leave it out: an emulated robot is as fast as possible"
        raise SpecError("command line", "--speed", "is given with --vehicle", remedy)
    else:
        problem = _driven_here(robot.chosen(), drive)
    if problem:
        print_event(Event.ERROR, f"the drive ended early: {problem}")
        sys.exit(ExitCode.FAILED)
    return drive.recording


def _driven_here(setup: "Setup", drive: DriveChoice) -> str:
    """Do the drive with an emulated robot; return why it ended early, or ""."""
    from touchline.jobs.calibration.calibration_simulation import drive_to_calibrate

    check_follower(setup.onboard)
    pose = setup.scenario.standing()
    planned = drive.planned(setup.vehicle, (pose.x_m, pose.y_m, pose.heading_rad))
    with progress_bar("Calibration drive") as advance:
        outcome = drive_to_calibrate(setup, planned, drive.recording, advance)
    return "" if outcome.report.success else outcome.reason or "the robot has not come to its end"


def _driven_on_bus(config: "BusConfig", drive: DriveChoice) -> str:
    """Do the drive with the robot on the bus; return why it ended early, or "".

    Raises:
        CallError: There is no such robot.
    """
    from touchline.bus import Bus
    from touchline.cli.run_command import setup_of, watch_robot
    from touchline.jobs.calibration.calibration_on_bus import CalibrationRun
    from touchline.jobs.single.bus_run import JobOptions
    from touchline.schemas.messages import GetDiagnosticsRequest

    with Bus.open(topics.OPERATOR, config) as bus, progress_bar(f"Calibration drive, {config.namespace}") as advance:
        presence = bus.presence()
        bus.call(topics.diagnostics_service(topics.ROBOT_SIM), GetDiagnosticsRequest())
        vehicle = setup_of(bus).vehicle
        options = JobOptions("", PlanOptions(), speed_factor(drive.speed or "1"), drive.recording, vehicle=vehicle)
        terminal = Terminal(advance, partial(watch_robot, presence, config.namespace))
        try:
            done = CalibrationRun(bus, options, terminal, drive=drive.planned(vehicle)).run()
        except JobFailed as error:
            return str(error)
    return "" if done["success"] else str(done["reason"])


def _print(file: Path, found: "Calibration") -> None:
    table = Table("constant", "file", "found", "σ", "unit", "remark", title=f"Constants by {file}")
    for each in found.findings:
        told = not each.against and not found.doubts
        value, sigma = (f"{each.in_file + each.change:z.5f}", f"{each.sigma:.5f}") if told else ("", "")
        remark = each.against or ("not believed, for the reasons below" if found.doubts else "")
        table.add_row(each.constant.name, f"{each.in_file:.5g}", value, sigma, each.constant.unit, remark)
    for figure in found.beside:
        told = math.isfinite(figure.value)
        value, sigma = (f"{figure.value:z.5f}", f"{figure.sigma:.5f}") if told else ("", "")
        table.add_row(figure.name, "", value, sigma, figure.unit, figure.remark)
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
