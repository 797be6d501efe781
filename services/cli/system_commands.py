"""``touchline up|status|down``: the whole system on this machine."""

import json
import sys
from dataclasses import asdict, astuple, dataclass
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import GetDiagnosticsRequest, TraversalStatus
from touchline.schemas.plain_text import plain
from touchline.services.bus import Bus, BusConfig, CallError
from touchline.services.cli.choices import SetupChoice
from touchline.services.cli.display import output, print_event, say
from touchline.services.cli.groups import with_groups
from touchline.services.cli.options import ExitCode, JsonOption, RecordingsOption, speed_factor
from touchline.services.cli.ros2_choice import Ros2Choice
from touchline.services.system.diagnostics import read_health
from touchline.services.system.running_system import only_one, running_pid, stop_running
from touchline.services.system.shutdown import until_stopped
from touchline.services.system.temporary_system import local_system, publish_notices, severity_of

_STOP_TIMEOUT_S = 20.0
_STATE_NAMES = {
    getattr(TraversalStatus, name): name.lower()
    for name in ("IDLE", "READY", "RUNNING", "PAUSED", "DONE", "ABORTED", "ESTOPPED")
}


def register(app: typer.Typer) -> None:
    """Add the subcommands."""
    app.command("up")(with_groups(up))
    app.command("status")(status)
    app.command("down")(down)


def up(
    robot: SetupChoice,
    ros: Ros2Choice,
    speed: Annotated[
        str, typer.Option(metavar="FACTOR", help="Times real time, or `max`; the console can change it.")
    ] = "1",
    recordings: RecordingsOption = None,
) -> None:
    """Start planner, robot and bridge, watch them and restart what dies, until Ctrl-C or `touchline down`."""
    config = BusConfig.from_environment()
    gateway = ros.gateway()
    setup = robot.chosen()
    speed_factor(speed)  # refused here rather than by a process that is then started again and again
    with (
        until_stopped() as stop,
        only_one(config),
        local_system(
            setup,
            config,
            ["--speed", speed],
            gateway.arguments() if gateway else (),
            join_as=topics.SUPERVISOR,  # nobody who could stop the robot: that is who has a console
            recordings=recordings,
        ) as system,
    ):
        if system.wait_until_ready(say, lambda: bool(stop)):
            say(f"Touchline is up on {config.endpoint}; open a console with `touchline tui`, stop with Ctrl-C")
            if where := ros.told(config.namespace):
                say(where)
        publish_notices(system, lambda: bool(stop), lambda notice: print_event(severity_of(notice), notice.text))
    say("Touchline is down")


def down(as_json: JsonOption = False) -> None:
    """Stop the system that `touchline up` runs on this bus."""
    pid = stop_running(BusConfig.from_environment(), _STOP_TIMEOUT_S)
    if as_json:
        typer.echo(json.dumps({"stopped_pid": pid}))
    else:
        typer.echo("nothing was running" if pid is None else f"stopped (pid {pid})")


@dataclass(frozen=True)
class ServiceState:
    """One service as ``touchline status`` shows it."""

    node: str
    state: str
    pid: int | None = None
    published: int | None = None
    received: int | None = None
    lost: int | None = None
    rejected: int | None = None


def status(as_json: JsonOption = False) -> None:
    """Show which services are on the bus and how they are."""
    config = BusConfig.from_environment()
    with Bus.open(topics.OBSERVER, config) as bus:
        missing = bus.wait_for({topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE}, timeout_s=0.5)
        states = [_state(bus, node, node in missing) for node in (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)]
        traversal = _traversal(bus) if topics.ROBOT_SIM not in missing else None
    shown = {
        "endpoint": config.endpoint,
        "namespace": config.namespace,
        "supervisor_pid": running_pid(config),
        "services": [asdict(state) for state in states],
        "traversal": traversal,
    }
    if as_json:
        typer.echo(json.dumps(shown, indent=2))
    else:
        _print(shown, states)
    if missing:
        sys.exit(ExitCode.FAILED)


def _state(bus: Bus, node: str, missing: bool) -> ServiceState:
    if missing:
        return ServiceState(node, "not running")
    try:
        answer = bus.call(topics.diagnostics_service(node), GetDiagnosticsRequest(), timeout_s=2.0)
    except (CallError, PayloadError):
        return ServiceState(node, "does not answer")
    health = read_health(node, answer.diagnostics)
    return ServiceState(node, health.message, *astuple(health)[1:])


def _traversal(bus: Bus) -> dict[str, Any] | None:
    for sample in bus.inbox([topics.STATUS], keep="latest").wait(5.0):  # a robot that is there has said it
        message = sample.decode()
        if isinstance(message, TraversalStatus):
            return {
                "state": _STATE_NAMES[message.state],
                "segment": message.segment_id,
                "coverage_pct": None if message.state == TraversalStatus.IDLE else message.coverage_pct,
                "remaining_s": message.remaining_s,
            }
    return None


def _print(shown: dict[str, Any], states: list[ServiceState]) -> None:
    table = Table("service", "state", "pid", "published", "received", "lost", "rejected")
    for state in states:
        table.add_row(*("–" if value is None else escape(plain(str(value))) for value in asdict(state).values()))
    console = output()
    pid = shown["supervisor_pid"]
    console.print(f"robot {shown['namespace']} on {shown['endpoint']}" + (f", supervisor pid {pid}" if pid else ""))
    console.print(table)
    if shown["traversal"]:
        job = shown["traversal"]
        painted = "" if job["coverage_pct"] is None else f", {job['coverage_pct']:.1f} % painted"
        at = f" at {job['segment']}" if job["segment"] else ""
        console.print(plain(f"traversal: {job['state']}{at}{painted}"), markup=False)
