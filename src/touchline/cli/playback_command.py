"""``touchline playback``: controls a replay on the bus."""

import math
import sys
import time
import uuid
from typing import Annotated, Any

import typer

from touchline.bus import Bus
from touchline.bus.config import named_robots
from touchline.cli.display import print_figures, print_json
from touchline.cli.options import ExitCode, JsonOption, RobotOption, config_of, speed_factor
from touchline.schemas import topics
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import (
    CommandRequest,
    ReplaySeekRequest,
    ReplaySetLoopsRequest,
    ReplayStatus,
    ReplayStepRequest,
    SetSpeedRequest,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.plain_text import plain
from touchline.schemas.replay_steps import STEP_S
from touchline.schemas.topics import Service

_LOOK_S = 0.5
_STATUS_S = 2.0
#: A seek in a long recording without an index reads it from the beginning.
_PATIENCE_S = 120.0

TimeArgument = Annotated[
    str, typer.Argument(metavar="TIME", help="Time of the recording, s; +S or -S: relative to the present one.")
]


def register(app: typer.Typer) -> None:
    """Add the group of subcommands to `app`."""
    playback = typer.Typer(no_args_is_help=True, help="Control a replay on the bus: pause, seek, step, speed, loops.")
    for command in (status, pause, resume, step, speed, loop):
        playback.command()(command)
    playback.command(context_settings={"ignore_unknown_options": True})(seek)  # a time may begin with a minus
    app.add_typer(playback, name="playback")


def status(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the state of the replay."""
    with Bus.open(topics.OBSERVER, config_of(robot)) as bus:
        reply = _status_of(_replaying(bus, robot))
    figures = reply.model_dump()
    if as_json:
        finite = {
            key: None if isinstance(value, float) and math.isnan(value) else value for key, value in figures.items()
        }
        print_json(finite)
    else:
        print_figures("Replay", {**figures, "robots": ", ".join(reply.robots)})


def pause(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Pause the replay."""
    _order("pause", topics.REPLAY_PAUSE, CommandRequest(request_id=uuid.uuid4().hex), robot, as_json)


def resume(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Resume the replay."""
    _order("resume", topics.REPLAY_RESUME, CommandRequest(request_id=uuid.uuid4().hex), robot, as_json)


def seek(time_s: TimeArgument, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Seek to a time; the state at that time is sent again."""
    try:
        value = float(time_s)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SpecError(
            "command line", "TIME", f"is {time_s!r}", "give a time of the recording in s, such as 120 or +10"
        )
    with Bus.open(topics.OPERATOR, config_of(robot)) as first:
        bus = _replaying(first, robot)
        if time_s.lstrip().startswith(("+", "-")):
            value += _status_of(bus).now_s
        request = ReplaySeekRequest(request_id=uuid.uuid4().hex, time_s=value)
        _print_reply(bus.namespace, "seek", bus.call(topics.REPLAY_SEEK, request, _PATIENCE_S), as_json)


def step(
    messages: Annotated[int, typer.Option(metavar="N", help="Number of messages.", min=0)] = 0,
    seconds: Annotated[float, typer.Option(metavar="S", help="Sim time, s.", min=0.0)] = 0.0,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Send the next messages, by default 0.1 s of them, and pause."""
    if messages and seconds:
        raise SpecError("command line", "--seconds", "and --messages are both given", "give one of them")
    request_id = uuid.uuid4().hex
    if messages:
        request = ReplayStepRequest(request_id=request_id, messages=messages)
    else:
        request = ReplayStepRequest(request_id=request_id, seconds=seconds or STEP_S)
    _order("step", topics.REPLAY_STEP, request, robot, as_json)


def speed(
    factor: Annotated[str, typer.Argument(metavar="FACTOR", help="Pace, × real time, or max.")],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Set the pace of the replay."""
    request = SetSpeedRequest(request_id=uuid.uuid4().hex, factor=speed_factor(factor, "FACTOR"))
    _order("speed", topics.REPLAY_SET_SPEED, request, robot, as_json)


def loop(
    times: Annotated[int, typer.Argument(metavar="N", help="Passes in all (0: endless).", min=0)],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Set the number of passes."""
    request = ReplaySetLoopsRequest(request_id=uuid.uuid4().hex, loops=times)
    _order("loop", topics.REPLAY_SET_LOOPS, request, robot, as_json)


def _order(what: str, service: Service[Any, Any], request: Message, robot: str | None, as_json: bool) -> None:
    with Bus.open(topics.OPERATOR, config_of(robot)) as first:
        bus = _replaying(first, robot)
        _print_reply(bus.namespace, what, bus.call(service, request, _PATIENCE_S), as_json)


def _replaying(bus: Bus, robot: str | None) -> Bus:
    """Return the bus of the named robot, or of the first one that is replayed.

    Raises:
        TouchlineError: There is no replay.
    """
    there = bus.roster().look({topics.REPLAY}, _LOOK_S)
    if robot is not None or named_robots():
        if bus.namespace not in there:
            others = f", but one of {', '.join(there)}" if there else ""
            raise TouchlineError(f"there is no replay of {bus.namespace} on the bus{others}")
        return bus
    if not there:
        raise TouchlineError("there is no replay on the bus; start one with `touchline replay FILE`")
    return bus if bus.namespace in there else bus.of(there[0])


def _status_of(bus: Bus) -> ReplayStatus:
    inbox = bus.inbox([topics.REPLAY_STATUS], keep="latest")
    deadline = time.monotonic() + _STATUS_S
    while time.monotonic() < deadline:
        for _, message in inbox.messages():
            if isinstance(message, ReplayStatus):
                return message
        time.sleep(0.01)
    raise TouchlineError(f"the replay of {bus.namespace} does not report its status")


def _print_reply(robot: str, order: str, answer: Any, as_json: bool) -> None:
    message = plain(answer.message)
    if as_json:
        print_json({"robot": robot, "order": order, "success": answer.success, "message": message})
    elif answer.success:
        typer.echo(f"{order}: {message}")
    else:
        typer.echo(f"{order} refused: {message}", err=True)
    if not answer.success:
        sys.exit(ExitCode.FAILED)
