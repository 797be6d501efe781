"""``touchline fleet``: teams of robots that share an area."""

import json
import uuid
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from touchline.cli.dispatch_command import register_dispatch
from touchline.cli.display import print_json, print_line, progress_bar
from touchline.cli.groups import with_groups
from touchline.cli.number_list import numbers_of
from touchline.cli.options import ExitCode, JsonOption, ReportOption, SecureOption, SpeedOption, config_of
from touchline.cli.output_choice import deliver
from touchline.cli.sweep_command import collect
from touchline.cli.sweep_output import SweepOutput
from touchline.cli.team_choice import RobotsCountOption, SeedOption, TeamChoice
from touchline.cli.team_runs import run_on_bus, simulated
from touchline.cli.workers_choice import WorkersChoice
from touchline.recordings.writing import check_recordable
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import CommandRequest, TeamRobotRequest, TeamTaskRequest
from touchline.schemas.messages.base import Message
from touchline.schemas.spec import EVERY_FIELD, read_text
from touchline.schemas.team import MOST_ROBOTS, TeamScenario
from touchline.schemas.topics import TEAM_NAMESPACE, Service

_TASK_S: Final = 120.0
"""Timeout, s: robots that were never guided first compile what guiding needs."""
_ROBOT_S: Final = 10.0

TeamNameOption = Annotated[str, typer.Option("--team-name", metavar="NAME", help="Namespace of the team.")]
RecordAllOption = Annotated[Path | None, typer.Option(metavar="FILE.mcap", help="Record all robots to this MCAP file.")]
RobotArgument = Annotated[str, typer.Argument(metavar="ROBOT", help="Name of the robot.")]


def register(app: typer.Typer) -> None:
    """Add the group of subcommands to `app`."""
    fleet = typer.Typer(no_args_is_help=True, help="Teams of robots that share an area and never touch.")
    fleet.command("team")(team)
    fleet.command("robots")(with_groups(robots_of))
    fleet.command("simulate")(with_groups(simulate))
    fleet.command("run")(with_groups(run))
    fleet.command("sweep")(with_groups(sweep))
    fleet.command("task")(task)
    fleet.command("stop")(stop)
    fleet.command("remove")(remove)
    fleet.command("admit")(admit)
    register_dispatch(fleet)
    app.add_typer(fleet, name="fleet")


def team() -> None:
    """Print a team as JSON with every field: to change and give as `--team`."""
    typer.echo(TeamScenario().model_dump_json(indent=1, context=EVERY_FIELD))


def robots_of(
    robots: RobotsCountOption = None,
    seed: SeedOption = None,
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only this robot; may be repeated (default: all).")
    ] = None,
    *,
    choice: TeamChoice,
) -> None:
    """Print a team's emulated robots as JSON, for `robot-sim --robots` on this machine or another."""
    from touchline.coordination.start_poses import free_area, start_poses

    chosen = choice.chosen(robots, seed)
    for name in only or ():
        if name not in chosen.names:
            raise SpecError("command line", "--only", f"is {name!r}", f"use {', '.join(chosen.names)}")
    places = start_poses(chosen, free_area(chosen))
    setups = {name: chosen.setup(name, places[name]) for name in only or chosen.names}
    typer.echo(Fleet.of(setups).model_dump_json())


def simulate(
    robots: RobotsCountOption = None,
    seed: SeedOption = None,
    hashed: Annotated[bool, typer.Option("--hash", help="Work out the session hash; takes a little longer.")] = False,
    record: RecordAllOption = None,
    *,
    choice: TeamChoice,
    report: ReportOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate a team in this process, in lockstep and without Zenoh; exit code 1 if any two robots touch."""
    check_recordable(record)
    figures = simulated(choice.chosen(robots, seed), hashed=hashed, record=record)
    deliver(f"Team of {figures['robots']}", figures, report, as_json)
    if not figures["success"]:
        raise typer.Exit(ExitCode.FAILED)


def run(
    robots: RobotsCountOption = None,
    seed: SeedOption = None,
    speed: SpeedOption = "max",
    apart: Annotated[bool, typer.Option("--processes", help="Run each robot in its own process.")] = False,
    record: RecordAllOption = None,
    secure: SecureOption = False,
    *,
    choice: TeamChoice,
    report: ReportOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a team over Zenoh in lockstep: coordinator, emulated robots and, with --record, bridge as processes.

    They use a private bus, unless $TOUCHLINE_ENDPOINT names one, where a console sees them. With --secure each robot
    runs in its own process.
    """
    check_recordable(record)
    figures = run_on_bus(choice.chosen(robots, seed), speed, apart=apart, record=record, secure=secure)
    deliver(f"Team of {figures['robots']}", figures, report, as_json)
    if not figures["success"]:
        raise typer.Exit(ExitCode.FAILED)


def sweep(
    robots: Annotated[
        str | None, typer.Option(metavar="N,N…", help="Team sizes to simulate (default: the team's, 10).")
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", help="Runs of each size, with consecutive seeds.", min=1)] = 20,
    seed: SeedOption = None,
    random_faults: Annotated[
        bool, typer.Option("--random-faults", help="Add random faults of robots, computers and radio, by seed.")
    ] = False,
    *,
    choice: TeamChoice,
    processes: WorkersChoice,
    results: SweepOutput,
) -> None:
    """Simulate teams of several sizes with many seeds on all cores; exit code 1 if any two robots touch."""
    from touchline.jobs.sweep.combinations import team_cases
    from touchline.jobs.sweep.task import lost_run, perform, prepare

    teams = [choice.chosen(size, seed) for size in _sizes(robots)]
    cases = team_cases(teams, random_faults=random_faults)
    with progress_bar("Touchline") as advance:
        jobs, tasks = prepare(cases, seeds)
        swept = collect(processes.done(perform, jobs, tasks, lost_run), len(tasks), advance)
    results.conclude(swept, cases)


def _sizes(text: str | None) -> list[int | None]:
    """Return the requested sizes of teams; None: the team's own.

    Raises:
        SpecError: A size is not usable.
    """
    if text is None:
        return [None]
    sizes = numbers_of("--robots", text, range(1, 33), "10,20,50")
    for size in sizes:
        if size != int(size) or not 1 <= size <= MOST_ROBOTS:
            raise SpecError("command line", "--robots", f"has {size:g}", f"give whole numbers from 1 to {MOST_ROBOTS}")
    return [int(size) for size in sizes]


def task(
    what: Annotated[str, typer.Argument(metavar="KIND|FILE", help="deploy, swap, or a JSON file of a task.")],
    robot: TeamNameOption = TEAM_NAMESPACE,
    as_json: JsonOption = False,
) -> None:
    """Give a team on the bus a task; its coordinator starts it, or continues it if it is the present one."""
    text = json.dumps({"kind": what}) if what in ("deploy", "swap") else read_text(Path(what))
    _ask(topics.TEAM_TASK, TeamTaskRequest(request_id=uuid.uuid4().hex, task_json=text), _TASK_S, robot, as_json)


def stop(robot: TeamNameOption = TEAM_NAMESPACE, as_json: JsonOption = False) -> None:
    """Pause every robot of a team on the bus; `touchline order resume` continues."""
    _ask(topics.TEAM_STOP, CommandRequest(request_id=uuid.uuid4().hex), _TASK_S, robot, as_json)


def remove(
    name: RobotArgument,
    force: Annotated[
        bool, typer.Option("--force", help="Remove it even if it may still drive: you guarantee that it does not.")
    ] = False,
    robot: TeamNameOption = TEAM_NAMESPACE,
    as_json: JsonOption = False,
) -> None:
    """Remove a robot that has been taken off the ground from a team on the bus, so that the others ignore it."""
    request = TeamRobotRequest(request_id=uuid.uuid4().hex, robot=name, force=force)
    _ask(topics.TEAM_REMOVE, request, _ROBOT_S, robot, as_json)


def admit(name: RobotArgument, robot: TeamNameOption = TEAM_NAMESPACE, as_json: JsonOption = False) -> None:
    """Let a removed robot join its team on the bus again; it may stand elsewhere."""
    _ask(topics.TEAM_ADMIT, TeamRobotRequest(request_id=uuid.uuid4().hex, robot=name), _ROBOT_S, robot, as_json)


def _ask(service: Service[Any, Any], request: Message, timeout_s: float, team_name: str, as_json: bool) -> None:
    """Call a team's coordinator and print its answer; the exit code shows whether it is a success."""
    from touchline.bus import Bus

    with Bus.open(topics.OPERATOR, config_of(team_name)) as bus:
        response = bus.call(service, request, timeout_s)
    if as_json:
        print_json({"success": response.success, "message": response.message})
    else:
        print_line(response.message)
    if not response.success:
        raise typer.Exit(ExitCode.FAILED)
