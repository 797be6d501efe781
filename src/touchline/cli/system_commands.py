"""``touchline up|status|down``: the whole system on this machine."""

import sys
from contextlib import nullcontext
from dataclasses import asdict, astuple, dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from touchline.bus import Bus, BusConfig, CallError
from touchline.bus.config import named_robots
from touchline.bus.secured_check import check_secured
from touchline.cli.choices import SetupChoice
from touchline.cli.display import print_event, print_json, print_line, print_table, say
from touchline.cli.foxglove_choice import FoxgloveChoice
from touchline.cli.groups import with_groups
from touchline.cli.options import (
    ExitCode,
    JsonOption,
    LogsOption,
    RecordingsOption,
    RobotsOption,
    SecureOption,
    SomeRobotsOption,
    speed_factor,
)
from touchline.cli.ros2_choice import Ros2Choice
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import GetDiagnosticsRequest, ReplayStatus, TraversalStatus
from touchline.schemas.plain_text import plain
from touchline.schemas.roles import Role
from touchline.supervision.diagnostics import read_health
from touchline.supervision.running_system import only_one, running_pid, stop_running
from touchline.supervision.secured_system import renewed, system_identities
from touchline.supervision.shutdown import until_stopped
from touchline.supervision.temporary_system import ProcessOptions, local_system, publish_notices, severity_of

if TYPE_CHECKING:  # few systems have these doors
    from touchline.services.bridge.foxglove import FoxgloveConfig, ViewerAccess
    from touchline.services.bridge.gateway import GatewayConfig

_STOP_TIMEOUT_S = 20.0
_LOOK_S = 0.5
_MISSING = "not on the bus"
_COUNTS = ("pid", "published", "received", "lost", "rejected")
_STATE_NAMES = {
    getattr(TraversalStatus, name): name.lower()
    for name in ("IDLE", "READY", "RUNNING", "PAUSED", "DONE", "ABORTED", "ESTOPPED")
}


def register(app: typer.Typer) -> None:
    """Add the subcommands to `app`."""
    app.command("up")(with_groups(up))
    app.command("status")(status)
    app.command("down")(down)


def up(
    robot: SetupChoice,
    ros: Ros2Choice,
    viewers: FoxgloveChoice,
    fleet: RobotsOption = None,
    apart: Annotated[bool, typer.Option("--apart", help="Run each robot in its own process.")] = False,
    secure: SecureOption = False,
    speed: Annotated[
        str, typer.Option(metavar="FACTOR", help="Pace, × real time, or `max`; the console can change it.")
    ] = "1",
    recordings: RecordingsOption = None,
    logs: LogsOption = None,
) -> None:
    """Start planner, robots and bridge, watch them and restart what dies, until Ctrl-C or `touchline down`."""
    from touchline.services.robot_sim.together import check_together

    config = BusConfig.from_environment()
    viewers.check_free()
    gateway, server = viewers.with_clock(ros.gateway()), viewers.server()
    robots = robot.chosen_robots(fleet, config.namespaces)
    identities = system_identities(list(robots)) if secure else {}
    if identities:
        config = BusConfig(identities[Role.SUPERVISOR].access.router)
        if gateway is not None:
            gateway = replace(gateway, identity=gateway.identity or str(identities[Role.GATEWAY].folder))
        if server is not None:
            server = replace(server, identity=server.identity or str(identities[Role.VIEWER].folder))
    elif not apart:
        check_together(robots)
    config = config.of(*robots)
    access = _access(gateway, server, config.as_identity(identities.get(Role.SUPERVISOR) or config.identity))
    speed_factor(speed)  # refused here rather than by a process that would be restarted again and again
    with (
        until_stopped() as stop,
        only_one(config),
        local_system(
            robots,
            config,
            ProcessOptions(
                ["--speed", speed],
                [each for one in (gateway, server) if one is not None for each in one.arguments()],
                recordings,
                apart,
                logs=logs,
                identities=identities,
            ),
            join_as=topics.SUPERVISOR,  # not as one who could stop a robot: that is who has a console
        ) as system,
        renewed(list(robots)) if secure else nullcontext(),
    ):
        if system.wait_until_ready(say, lambda: bool(stop)):
            if identities:
                check_secured(system.bus.config.of(*robots), identities[Role.OBSERVER])
            which = f" with {', '.join(robots)}" if len(robots) > 1 else ""
            console = f"`touchline tui{f' --identity {identities[Role.OPERATOR].name}' if identities else ''}`"
            say(f"Touchline is up on {config.endpoint}{which}; open a console with {console}, stop with Ctrl-C")
            for where in (ros.notice(config.namespaces), viewers.notice(access) if access is not None else ""):
                if where:
                    say(where)
        publish_notices(system, lambda: bool(stop), lambda notice: print_event(severity_of(notice), notice.text))
    say("Touchline is down")


def _access(
    gateway: "GatewayConfig | None", server: "FoxgloveConfig | None", config: BusConfig
) -> "ViewerAccess | None":
    """Check the doors of the bridge before anything is started, and return the requirements for viewers.

    Args:
        gateway: Gateway to ROS 2, if any.
        server: Server of viewers, if any.
        config: The bus.

    Raises:
        SpecError: One is open to the network without protection, or its options do not suit the bus.
    """
    if gateway is not None:
        gateway.checked(config)
    if server is None:
        return None
    from touchline.services.bridge.foxglove import ViewerAccess

    return ViewerAccess.of(server, config)


def down(robot: SomeRobotsOption = None, as_json: JsonOption = False) -> None:
    """Stop what `touchline up` runs on this bus: all of it, or the systems of the named robots."""
    pids = stop_running(BusConfig.from_environment(), _STOP_TIMEOUT_S, robot or named_robots())
    if as_json:
        print_json({"stopped_pids": pids})
    else:
        typer.echo(f"stopped (pid {', '.join(map(str, pids))})" if pids else "nothing was running")


@dataclass(frozen=True)
class ServiceState:
    """State of a service, as ``touchline status`` shows it."""

    node: str
    state: str
    pid: int | None = None
    published: int | None = None
    received: int | None = None
    lost: int | None = None
    rejected: int | None = None


@dataclass(frozen=True)
class RobotState:
    """State of a robot, as ``touchline status`` shows it."""

    namespace: str
    supervisor_pid: int | None
    services: list[ServiceState]
    traversal: dict[str, Any] | None


def status(robot: SomeRobotsOption = None, as_json: JsonOption = False) -> None:
    """Show the robots, services and replays on the bus, and their state."""
    config = BusConfig.from_environment()
    named = tuple(robot or named_robots())
    with Bus.open(topics.OBSERVER, config.of((named or config.namespaces)[0])) as bus:
        names = named or bus.roster().look((*topics.SERVING, topics.REPLAY), _LOOK_S) or config.namespaces
        robots = [_robot(bus if name == bus.namespace else bus.of(name)) for name in names]
    if as_json:
        print_json({"endpoint": config.endpoint, "robots": [asdict(each) for each in robots]})
    else:
        _print(config.endpoint, robots)
    if any(service.state == _MISSING for each in robots for service in each.services):
        sys.exit(ExitCode.FAILED)


def _robot(bus: Bus) -> RobotState:
    missing = bus.wait_for(set(topics.SERVING), timeout_s=_LOOK_S)
    replayed = topics.ROBOT_SIM in missing and not bus.wait_for({topics.REPLAY}, timeout_s=_LOOK_S)
    if replayed:  # what published these messages then need not be there now
        states = [_state(bus, node, missing=False) for node in topics.SERVING if node not in missing]
        states.append(ServiceState(topics.REPLAY, _replay(bus)))
    else:
        states = [_state(bus, node, node in missing) for node in topics.SERVING]
    traversal = _traversal(bus) if replayed or topics.ROBOT_SIM not in missing else None
    return RobotState(bus.namespace, running_pid(bus.config), states, traversal)


def _state(bus: Bus, node: str, missing: bool) -> ServiceState:
    if missing:
        return ServiceState(node, _MISSING)
    try:
        answer = bus.call(topics.diagnostics_service(node), GetDiagnosticsRequest(), timeout_s=2.0)
    except (CallError, PayloadError):
        return ServiceState(node, "does not answer")
    health = read_health(node, answer.diagnostics)
    return ServiceState(node, health.message, *astuple(health)[1:])


def _replay(bus: Bus) -> str:
    """Return the progress of the replay."""
    for sample in bus.inbox([topics.REPLAY_STATUS], keep="latest").wait(2.0):
        message = sample.decode()
        if isinstance(message, ReplayStatus):
            does = "plays" if message.playing else "paused"
            return f"{does} {message.file}, {message.now_s:.1f} of {message.end_s:.1f} s"
    return "does not answer"


def _traversal(bus: Bus) -> dict[str, Any] | None:
    for sample in bus.inbox([topics.STATUS], keep="latest").wait(5.0):  # a robot that is there has published it
        message = sample.decode()
        if isinstance(message, TraversalStatus):
            return {
                "state": _STATE_NAMES[message.state],
                "segment": message.segment_id,
                "coverage_pct": None if message.state == TraversalStatus.IDLE else message.coverage_pct,
                "remaining_s": message.remaining_s,
            }
    return None


def _print(endpoint: str, robots: list[RobotState]) -> None:
    for robot in robots:
        pid = f", supervisor pid {robot.supervisor_pid}" if robot.supervisor_pid else ""
        print_line(f"robot {robot.namespace} on {endpoint}{pid}")
    several = len(robots) > 1
    table = Table(*(["robot"] if several else []), "service", "state", *_COUNTS)
    for robot in robots:
        for number, state in enumerate(robot.services):
            name = [robot.namespace if number == 0 else ""] if several else []
            values = ("–" if value is None else escape(plain(str(value))) for value in asdict(state).values())
            table.add_row(*name, *values)
    print_table(table)
    for robot in robots:
        if robot.traversal:
            whose = f"{robot.namespace}: " if several else "traversal: "
            print_line(f"{whose}{_in_words(robot.traversal)}")


def _in_words(job: dict[str, Any]) -> str:
    done = "" if job["coverage_pct"] is None else f", {job['coverage_pct']:.1f} % done"
    at = f" at {job['segment']}" if job["segment"] else ""
    return f"{job['state']}{at}{done}"
