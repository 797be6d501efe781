"""``touchline record|replay``: sessions to files and back onto the bus."""

import sys
import time
import uuid
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from schemas import topics
from schemas.errors import TouchlineError
from schemas.messages import RecordRequest, RecordStopRequest
from services.bus import Bus
from services.cli.display import print_figures, progress_bar, say
from services.cli.options import ExitCode, SpeedOption, speed_factor
from services.lifecycle import until_stopped

_STOP_TIMEOUT_S = 120.0


def register(app: typer.Typer) -> None:
    """Add the subcommands."""
    app.command("record")(record)
    app.command("replay")(replay)


def record(
    file: Annotated[Path, typer.Argument(help="MCAP file to write.", show_default=False)],
    seconds: Annotated[float, typer.Option(help="Stop after this long; 0: at Ctrl-C.", min=0.0)] = 0.0,
) -> None:
    """Have the running bridge record the session until Ctrl-C."""
    with until_stopped() as stop, Bus.open(topics.OPERATOR, stop=lambda: bool(stop)) as bus:
        begun = bus.call(topics.RECORD, RecordRequest(request_id=uuid.uuid4().hex, path=str(file.absolute())))
        if not begun.success:
            raise TouchlineError(begun.message)
        say(f"recording to {file}; Ctrl-C stops")
        deadline = time.monotonic() + seconds if seconds else float("inf")
        while not stop and time.monotonic() < deadline:
            time.sleep(0.05)
        done = bus.call(topics.RECORD_STOP, RecordStopRequest(request_id=uuid.uuid4().hex), _STOP_TIMEOUT_S)
    if not done.success:
        raise TouchlineError(done.message)
    print_figures(f"Recording {file}", {"messages": done.messages, "bytes": done.bytes, "lost": done.lost})
    if done.lost:
        sys.exit(ExitCode.FAILED)


def replay(
    file: Annotated[Path, typer.Argument(help="MCAP file to replay.", show_default=False)],
    speed: SpeedOption = "1",
) -> None:
    """Send a recording onto the bus again, as if the robot were there; a cut-off file is sent up to its break."""
    from services.bridge.replay_service import run_replay

    with until_stopped() as stop, progress_bar("Replaying") as advance:
        sent = run_replay(
            file,
            speed_factor(speed),
            progress=lambda fraction, sim_time_s: advance(fraction, f"{sim_time_s:.0f} s"),
            stop=lambda: bool(stop),
        )
    print_figures(f"Replay of {file}", asdict(sent))
