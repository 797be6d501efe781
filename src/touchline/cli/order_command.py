"""``touchline order|fault|topics``: the robot's services from a shell, and the list of topics."""

import sys
import uuid
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich import box
from rich.table import Column, Table

from touchline.cli.display import print_json, print_table
from touchline.cli.fault_kinds import print_fault_kinds
from touchline.cli.options import ExitCode, JsonOption, RobotOption, config_of
from touchline.schemas import topics
from touchline.schemas.cdr import typestore
from touchline.schemas.definition_folder import write_definitions
from touchline.schemas.errors import SpecError
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import (
    CommandRequest,
    CommandResponse,
    InjectFaultRequest,
    InjectFaultResponse,
    LoadRequest,
)
from touchline.schemas.plain_text import plain
from touchline.schemas.spec import read_text
from touchline.schemas.topics import Service
from touchline.supervision.priority import FIRST, run_at

if TYPE_CHECKING:  # topics and kinds of faults are listed without Zenoh
    from touchline.bus import BusConfig

OrderName = Literal[
    "start",
    "pause",
    "resume",
    "go-on",
    "abort",
    "estop",
    "reset",
    "refill",
    "replace-battery",
    "wait-on",
    "go-round",
    "leave-out",
    "take-over",
    "remove",
]
_SERVICES = {
    "start": topics.START,
    "pause": topics.PAUSE,
    "resume": topics.RESUME,
    "abort": topics.ABORT,
    "estop": topics.ESTOP,
    "reset": topics.RESET,
    "refill": topics.REFILL_TANK,
    "replace-battery": topics.REPLACE_BATTERY,
    "wait-on": topics.WAIT_ON,
    "go-round": topics.GO_ROUND,
    "leave-out": topics.LEAVE_OUT,
    "take-over": topics.TAKE_OVER,
    "remove": topics.REMOVE,
}
_GO_ON = "go-on"
_ORDERS = (*_SERVICES, _GO_ON)
_LOAD_TIMEOUT_S = 30.0


def register(app: typer.Typer) -> None:
    """Add the subcommands to `app`."""
    app.command("order")(order)
    app.command("fault")(fault)
    app.command("topics")(list_topics)


def order(
    what: Annotated[OrderName, typer.Argument(metavar="ORDER", help=f"Order: {', '.join(_ORDERS)}.")],
    patience_s: Annotated[
        float,
        typer.Option(
            "--patience",
            metavar="SECONDS",
            min=0.1,
            help="Longest time to repeat estop, pause and abort until acknowledged, s.",
        ),
    ] = 30.0,
    robot: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Namespace of a robot; may be repeated. Default: $TOUCHLINE_NAMESPACE; without that, estop, pause and "
            "abort go to every robot on the bus, other orders to tt2.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Give a robot on the bus an order, as the console does; exit code 1 if it refuses.

    resume ends a pause. go-on continues a job from the robot's journal after an abort or a restart of the robot.

    wait-on, go-round and leave-out answer a robot that waits before something in its way: it waits until that has gone,
    goes round it now, or does so and leaves out for good what it could not reach beside it.

    take-over and remove are for a robot that has failed in `touchline run --robots`: take-over gives the others its
    remaining work, remove reports that it has been taken off the ground. Orders that stop a robot are repeated until
    they are acknowledged; standard error shows while they are not.
    """
    from touchline.bus import BusConfig, UrgentOrder, repeat_until_acknowledged
    from touchline.bus.config import named_robots

    config = BusConfig.from_environment(robot or ())
    if what == _GO_ON:
        _print_answers(_continue_jobs(config), what, config, as_json)
        return
    service, request = _SERVICES[what], CommandRequest(request_id=uuid.uuid4().hex)
    if service.urgent:
        run_at(FIRST)
        typestore()  # takes a tenth of a second, which the order itself need not wait for
        urgent = UrgentOrder(service, request, patience_s, everyone=not (robot or named_robots()))
        answers = repeat_until_acknowledged(urgent, topics.OPERATOR, config, partial(_print_unacknowledged, what))
    else:
        answers = _send(service, request, config)
    _print_answers(answers, what, config, as_json)


def _send(
    service: Service[CommandRequest, CommandResponse], request: CommandRequest, config: "BusConfig"
) -> Iterator[tuple[str, CommandResponse]]:
    from touchline.bus import Bus

    with Bus.open_all(topics.OPERATOR, config) as buses:
        for bus in buses:
            yield bus.namespace, bus.call(service, request)


def _continue_jobs(config: "BusConfig") -> Iterator[tuple[str, CommandResponse]]:
    """Load the job of each robot's journal, and start it."""
    from touchline.bus import Bus

    with Bus.open_all(topics.OPERATOR, config) as buses:
        for bus in buses:
            loaded = bus.call(topics.LOAD, LoadRequest(request_id=uuid.uuid4().hex, resume=True), _LOAD_TIMEOUT_S)
            answer = CommandResponse(success=loaded.success, message=loaded.message)
            if loaded.success:
                started = bus.call(topics.START, CommandRequest(request_id=uuid.uuid4().hex))
                answer = started.model_copy(update={"message": answer.message}) if started.success else started
            yield bus.namespace, answer


def fault(
    what: Annotated[
        str | None,
        typer.Argument(
            help='Fault as in a scenario\'s timeline: JSON such as \'{"kind": "bumper", "duration_s": 0.5}\', '
            "or a JSON file. start_s counts from now."
        ),
    ] = None,
    list_kinds: Annotated[
        bool, typer.Option("--list", help="List the kinds of faults with their parameters instead.")
    ] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Inject a fault into the robot on the bus (--list and docs/reference/faults.md list the faults)."""
    if list_kinds:
        print_fault_kinds(as_json=as_json)
        return
    if what is None:
        raise SpecError("fault", "", "is missing", "give one, or --list for the kinds that there are")
    from touchline.bus import Bus

    config = config_of(robot)
    text = what if what.lstrip().startswith("{") else read_text(Path(what))
    parse_fault(text)  # an invalid fault is refused here, whether or not a robot is there
    with Bus.open(topics.OPERATOR, config) as bus:
        answer = bus.call(topics.INJECT_FAULT, InjectFaultRequest(request_id=uuid.uuid4().hex, fault_json=text))
    _print_answers([(config.namespace, answer)], "fault", config, as_json)


def _print_unacknowledged(what: str, problem: str) -> None:
    typer.echo(f"{what}: NOT ACKNOWLEDGED ({plain(problem)}); repeating, Ctrl-C ends", err=True)


def _print_answers(
    answers: Iterable[tuple[str, CommandResponse | InjectFaultResponse]], what: str, config: "BusConfig", as_json: bool
) -> None:
    """Print each answer as it comes."""
    refused = False
    for robot, answer in answers:
        message = plain(answer.message)
        shown = what if (robot,) == config.namespaces else f"{robot}: {what}"
        refused |= not answer.success
        if as_json:
            figures = {"robot": robot, "order": what, "success": answer.success, "message": message}
            print_json(figures)
        elif answer.success:
            typer.echo(f"{shown}: {message}")
        else:
            typer.echo(f"{shown} refused: {message}", err=True)
    if refused:
        sys.exit(ExitCode.FAILED)


def list_topics(
    as_json: JsonOption = False,
    msg_dir: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Write the .msg and .srv files of all types to this folder instead, standard ones included.",
        ),
    ] = None,
) -> None:
    """List every topic and service with its type; names are under the robot's namespace (tt2)."""
    if msg_dir is not None:
        _write_definitions(msg_dir)
        return
    if as_json:
        rows = [
            {
                "name": topic.name,
                "type": topic.type.ros_type,
                "rate_hz": topic.rate_hz,
                "units": topic.units,
                "recorded": topic.recorded,
                "latched": topic.latched,
                "reliable": topic.reliable,
                "tolerance": topic.tolerance,
            }
            for topic in topics.TOPICS
        ]
        services = [{"name": service.name, "type": service.ros_type} for service in topics.SERVICES]
        print_json({"topics": rows, "services": services})
        return
    table = Table(Column("topic", no_wrap=True), Column("type", no_wrap=True), "Hz", "units", "", box=box.SIMPLE_HEAD)
    table.caption, table.caption_justify = "R: recorded; L: late joiners get the last one", "left"
    for topic in topics.TOPICS:
        rate = f"{topic.rate_hz:g}" if topic.rate_hz else "on event"
        marks = " ".join(mark for mark, on in (("R", topic.recorded), ("L", topic.latched)) if on)
        table.add_row(topic.name, topic.type.ros_type.replace("/msg/", "/"), rate, topic.units, marks)
    offered = Table(Column("service", no_wrap=True), "type", box=box.SIMPLE_HEAD)
    for service in topics.SERVICES:
        offered.add_row(service.name, service.ros_type.replace("/srv/", "/"))
    print_table(table)
    print_table(offered)


def _write_definitions(folder: Path) -> None:
    try:
        packages = write_definitions(folder)
    except FileExistsError as error:
        remedy = "give an empty folder, or a new one"
        raise SpecError("command line", "--msg-dir", f"is {str(folder)!r}, where {error} is already", remedy) from error
    except OSError as error:
        problem, remedy = f"is {str(folder)!r}, which cannot be written: {error.strerror}", "give another folder"
        raise SpecError("command line", "--msg-dir", problem, remedy) from error
    typer.echo(f"{folder}: {', '.join(packages)}")
