"""Fifty robots over Zenoh at real time, recorded, watched by a console: pace, losses, redraws and each process's share.

`python -m benchmarks fleet_recorded`; `robots` is how many, `seconds` the sim time, which has to pass at 0.95 of the
wall clock, or that by `slack`. It is `touchline fleet run --record` with the fleet screen of `touchline tui` beside it,
all on this machine's cores.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

from benchmarks._console_terminal import Terminal
from benchmarks._processes import cpu_s, processes
from benchmarks._settings import Small
from benchmarks._system import COMMAND
from touchline.bus import Bus, BusConfig, Inbox
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.messages import Clock

_START_S: Final = 120.0
_END_S: Final = 120.0
_LEAST_PACE: Final = 0.95
_SETTLED_S: Final = 4.0
"""Of sim time, until the console is there and the robots drive."""
SMALL: Final = Small(
    {"robots": 2, "seconds": 6.0, "slack": 100.0},
    (
        "sim time # to # s: # of the wall clock",
        "console: # redraws a second",
        *(f"{name} # of a core" for name in ("bridge", "coordinator", "robot-sim", "tui")),
    ),
)


class Moment(NamedTuple):
    """Resources used up to a time of a robot's clock."""

    sim_s: float
    wall_s: float
    redraws: int
    cores_s: dict[str, float]


def main(robots: int = 50, seconds: float = 40.0, slack: float = 1.0) -> None:
    """Run, and print how it went; exit code 1 if it failed, lost a message, or sim time fell behind."""
    config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}").of("tb1")
    with tempfile.TemporaryDirectory(prefix="touchline-bench-") as folder:
        recording = str(Path(folder) / "fleet.mcap")
        options = ("--robots", str(robots), "--duration", f"{seconds:g}", "--speed", "1", "--record", recording)
        with (Path(folder) / "log").open("w+b") as log, Bus.open(topics.OBSERVER, config) as bus:
            environment = {**os.environ, **config.environment()}
            command = subprocess.Popen([*COMMAND, "fleet", "run", *options], env=environment, stdout=log, stderr=log)
            try:
                moments = list(_watched(command, bus, config))
                command.wait(_END_S)
            finally:
                command.kill()
                command.wait()
            log.seek(0)
            words = log.read().decode(errors="replace").strip()
    print(words)
    if command.returncode != 0 or len(moments) < 2:
        sys.exit(f"touchline fleet run ended with exit code {command.returncode}")
    settled = next((moment for moment in moments if moment.sim_s >= _SETTLED_S), moments[0])
    if _print(settled, moments[-1]) < _LEAST_PACE / slack:
        sys.exit("sim time fell behind")


def _watched(command: subprocess.Popen[bytes], bus: Bus, config: BusConfig) -> Iterator[Moment]:
    """A moment for each second of a robot's clock, from when the console shows the fleet until the robot has gone."""
    inbox, presence = bus.inbox([topics.CLOCK], keep="latest"), bus.presence()
    if bus.wait_for({topics.ROBOT_SIM}, _START_S):
        sys.exit("the robots did not come up")
    presence.poll()
    terminal = Terminal(config)
    try:
        terminal.press("v")
        told_s = -1.0
        while command.poll() is None and topics.ROBOT_SIM in presence.alive():
            presence.poll()
            if (sim_s := _told(inbox)) >= told_s + 1.0:
                told_s = sim_s
                spent = {topics.CONSOLE: terminal.cpu_s()}
                for name, pid in processes(command.pid).items():
                    with suppress(OSError, IndexError):
                        spent[name] = cpu_s(pid)
                yield Moment(sim_s, time.monotonic(), terminal.redraws, spent)
            time.sleep(0.01)
    finally:
        terminal.leave()


def _told(inbox: Inbox) -> float:
    sim_s = -1.0
    for _, message in inbox.messages():
        if isinstance(message, Clock):
            sim_s = message.clock.seconds
    return sim_s


def _print(first: Moment, last: Moment) -> float:
    """The figures between two moments; returns the share of the wall clock."""
    wall_s = last.wall_s - first.wall_s
    pace = (last.sim_s - first.sim_s) / wall_s
    print(f"sim time {first.sim_s:.0f} to {last.sim_s:.0f} s: {pace:.2f} of the wall clock")
    print(f"console: {(last.redraws - first.redraws) / wall_s:.1f} redraws a second")
    for name, spent_s in sorted(last.cores_s.items()):
        print(f"  {name:24} {(spent_s - first.cores_s.get(name, 0.0)) / wall_s:5.2f} of a core")
    return pace
