"""``touchline replay``: sends a recording back onto the bus."""

import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from touchline.bus import BusConfig
from touchline.cli.display import print_event, print_figures, print_json, progress_bar
from touchline.cli.options import ExitCode, JsonOption, SpeedOption, speed_factor
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import Event
from touchline.supervision.shutdown import until_stopped


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("replay")(replay)


def replay(
    file: Annotated[Path, typer.Argument(metavar="RECORDING", help="Recording to replay (docs/guides/recordings.md).")],
    speed: SpeedOption = "1",
    from_s: Annotated[
        float | None, typer.Option("--from", metavar="S", help="Start at this time of the recording, s.")
    ] = None,
    to_s: Annotated[
        float | None, typer.Option("--to", metavar="S", help="End at this time of the recording, s.")
    ] = None,
    paused: Annotated[bool, typer.Option("--paused", help="Start paused.")] = False,
    stay: Annotated[bool, typer.Option("--stay", help="Pause at the end until Ctrl-C.")] = False,
    loop: Annotated[int, typer.Option(metavar="N", help="Number of passes (0: until Ctrl-C).", min=0)] = 1,
    robot: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Robot to replay, if the recording holds several; may be repeated. A single robot is replayed as "
            "NAME (default: $TOUCHLINE_NAMESPACE, or tt2).",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Replay a recording on the bus, as if its robots were there; a cut-off file is sent up to its break.

    Keys on a terminal: space pauses, arrows seek, . steps, + and - change the speed, q quits. `touchline playback` and
    the console control a replay from elsewhere.
    """
    from touchline.cli.replay_keys import HELP, replay_keys
    from touchline.recordings.replay.replay_player import ReplayPlayer
    from touchline.services.bridge.replay_controls import where
    from touchline.services.bridge.replay_service import Playback, run_replay

    factor, begin_s, end_s = speed_factor(speed), _time("--from", from_s, -math.inf), _time("--to", to_s, math.inf)
    playback = Playback(factor, robot or (), loop, begin_s, end_s, paused, stay)
    with until_stopped() as stop, progress_bar("Replaying") as advance, replay_keys() as keys:
        detail = ""

        def attend(player: ReplayPlayer) -> None:
            nonlocal detail
            keys.poll(player)
            detail = f"{where(player)}   {HELP}" if keys.there else where(player)

        sent = run_replay(
            file,
            playback,
            BusConfig.from_environment(robot or ()),
            progress=lambda fraction, _: advance(fraction, detail),
            attend=attend,
            stop=lambda: bool(stop) or keys.quit,
        )
        interrupted = bool(stop)
    if as_json:
        print_json(asdict(sent))
    else:
        print_figures(f"Replay of {file}", asdict(sent))
    for reason in sent.reasons:
        print_event(Event.WARN, f"not sent: {reason}")
    if interrupted:
        sys.exit(ExitCode.INTERRUPTED)
    if sent.skipped and not sent.sent:
        raise TouchlineError(f"{file}: none of its {sent.skipped:,} messages belongs to a topic of the bus")


def _time(option: str, value: float | None, default: float) -> float:
    if value is None:
        return default
    if not math.isfinite(value):
        raise SpecError("command line", option, f"is {value}", "give a time of the recording in s")
    return value
