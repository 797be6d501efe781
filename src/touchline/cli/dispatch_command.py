"""``touchline fleet dispatch``: tasks for a team, which a dispatcher assigns to its robots."""

import json
import uuid
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_figures, print_json, print_line, print_table
from touchline.cli.groups import with_groups
from touchline.cli.options import ExitCode, JsonOption, ReportOption, SecureOption, SpeedOption, config_of
from touchline.cli.team_choice import RobotsCountOption, SeedOption, TeamChoice
from touchline.cli.team_runs import run_on_bus, simulated
from touchline.recordings.writing import check_recordable, write_json
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.spec import EVERY_FIELD, parse, read_text
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.team import TeamScenario
from touchline.schemas.topics import TEAM_NAMESPACE

_ASK_S: Final = 10.0
_TASK_COLUMNS: Final = ("id", "category", "state", "robot", "started_s", "finished_s", "late_s", "reason")
_ROBOT_COLUMNS: Final = ("state", "charge", "driven_m", "used_wh", "charged_wh", "busy_s", "idle_s", "charging_s")


def register_dispatch(fleet: typer.Typer) -> None:
    """Add the subcommand to the group `fleet`."""
    fleet.command("dispatch")(with_groups(dispatch))


def dispatch(
    requests: Annotated[
        Path | None, typer.Argument(metavar="REQUESTS.json", help="Requests and docks (docs/guides/dispatch.md).")
    ] = None,
    robots: RobotsCountOption = None,
    seed: SeedOption = None,
    on_bus: Annotated[bool, typer.Option("--bus", help="Over Zenoh, with processes, as fleet run does.")] = False,
    apart: Annotated[bool, typer.Option("--processes", help="With --bus: each robot in its own process.")] = False,
    secure: SecureOption = False,
    speed: SpeedOption = "max",
    add: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Add the requests of a file to a team on the bus.")
    ] = None,
    cancel: Annotated[str | None, typer.Option(metavar="ID", help="Cancel a task of a team on the bus.")] = None,
    queue: Annotated[bool, typer.Option("--queue", help="Print the tasks and robots of a team on the bus.")] = False,
    robot: Annotated[
        str, typer.Option("--team-name", metavar="NAME", help="Namespace of the team on the bus.")
    ] = TEAM_NAMESPACE,
    record: Annotated[Path | None, typer.Option(metavar="FILE.mcap", help="Record all robots to this file.")] = None,
    *,
    choice: TeamChoice,
    report: ReportOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have a team carry out requests, simulated or over Zenoh; exit code 1 if a task is not completed."""
    asked = [add is not None, cancel is not None, queue]
    if sum(asked) + (requests is not None) != 1:
        remedy = "give REQUESTS.json, or one of --add, --cancel and --queue for a team on the bus"
        raise SpecError("command line", "dispatch", "is to do none or several things at once", remedy)
    if any(asked):
        _ask(add, cancel, robot, as_json)
        return
    assert requests is not None, "it is given if nothing else is"
    if secure and not on_bus:
        raise SpecError("command line", "--secure", "is given without --bus", "add --bus: a simulation has no bus")
    check_recordable(record)
    chosen = with_requests(choice.chosen(robots, seed), requests)
    if on_bus:
        figures = run_on_bus(chosen, speed, apart=apart, record=record, secure=secure)
    else:
        figures = simulated(chosen, hashed=False, record=record)
    if as_json:
        print_json(figures)
    else:
        _print(f"Team of {figures['robots']}", figures)
    if report is not None:
        write_json(figures, report)
    if not figures["success"]:
        raise typer.Exit(ExitCode.FAILED)


def with_requests(team: TeamScenario, file: Path) -> TeamScenario:
    """Return a team whose task is a file of requests.

    Raises:
        SpecError: The file is not usable, or not for this team.
    """
    task = parse(DispatchTask, read_text(file), file.name)
    fields = team.model_dump(mode="json", context=EVERY_FIELD) | {"task": task.model_dump(mode="json")}
    return parse(TeamScenario, json.dumps(fields), file.name)


def _print(title: str, figures: Mapping[str, Any]) -> None:
    """Print figures with a table of tasks and one of robots."""
    told = figures.get("dispatch") or {}
    short = {name: value for name, value in told.items() if name not in ("tasks", "robots", "stands")}
    print_figures(title, {**figures, "dispatch": short, "hash": {"session": figures["hash"]["session"]}})
    print_queue(told)


def print_queue(queue: Mapping[str, Any]) -> None:
    """Print the tasks and robots of a queue as tables."""
    _print_rows("Tasks", _TASK_COLUMNS, queue.get("tasks", ()))
    robots = [{"robot": name, **each} for name, each in queue.get("robots", {}).items()]
    _print_rows("Robots", ("robot", *_ROBOT_COLUMNS), robots)
    for each in queue.get("stands", ()):
        print_line(f"{each['robot']} stood from {each['from_s']:.0f} to {each['until_s']:.0f} s: {each['why']}")


def _print_rows(title: str, columns: tuple[str, ...], rows: Any) -> None:
    table = Table(*columns, title=title, title_justify="left", box=None, padding=(0, 1))
    for row in rows:
        table.add_row(*(escape(_shown(row[name])) for name in columns))
    print_table(table)


def _shown(value: Any) -> str:
    return "–" if value is None or value == "" else f"{value:.4g}" if isinstance(value, float) else str(value)


def _ask(add: Path | None, cancel: str | None, team_name: str, as_json: bool) -> None:
    """Add requests, cancel a task, or print the queue of a team on the bus."""
    from touchline.bus import Bus

    with Bus.open(topics.OPERATOR, config_of(team_name)) as bus:
        call = partial(bus.call, topics.TEAM_REQUESTS, timeout_s=_ASK_S)
        text = "{}"
        if add is not None:
            added = parse(DispatchTask, read_text(add), add.name).requests
            text = json.dumps({"add": [each.model_dump(mode="json") for each in added]})
        elif cancel is not None:
            text = json.dumps({"cancel": cancel})
        response = call(m.TeamTaskRequest(request_id=uuid.uuid4().hex, task_json=text))
    queue = add is None and cancel is None and response.success
    if as_json:
        print_json(
            json.loads(response.message) if queue else {"success": response.success, "message": response.message}
        )
    elif queue:
        print_queue(json.loads(response.message))
    else:
        print_line(response.message)
    if not response.success:
        raise typer.Exit(ExitCode.FAILED)
