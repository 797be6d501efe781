"""Redraws a second of the operator's console with fifty robots at real time, on one core.

The console is `touchline tui` in a pseudo-terminal, bound to one core; fifty robots that only talk, each as much as one
that paints, are a process on the other one. In the end the emergency stop is pressed.
`python -m benchmarks fleet_console`; `robots` is how many, `settled_s` how long a view is left alone before it is
measured for `measured_s`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np

from benchmarks._console_terminal import Terminal
from benchmarks._settings import Small
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.messages.touchline import TraversalStatus

SIZES = ((80, 24), (200, 60))
VIEWS = {"one robot": "", "fleet": "v"}
START_S = 90.0
SMALL = Small(
    {"robots": 2, "settled_s": 0.5, "measured_s": 0.5},
    (
        "# robots redraws/s of a core each kB/s",
        *(f"{columns}×{rows} {view} # # % # ms #" for columns, rows in SIZES for view in VIEWS),
        *(f"{columns}×{rows} e pressed: robots stopped after #, # and # ms" for columns, rows in SIZES),
    ),
)


def main(robots: int = 50, settled_s: float = 12.0, measured_s: float = 10.0) -> None:
    """Print redraws a second and the share of a core for every view and size."""
    names = tuple(f"r{number:02}" for number in range(robots))
    print(f"{robots} robots     {'redraws/s':>10} {'of a core':>10} {'each':>8} {'kB/s':>8}")
    for columns, rows in SIZES:
        config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}", namespaces=names)
        command = [sys.executable, "-m", "benchmarks._talking_fleet", *names]
        environment = {**os.environ, **config.environment(), "PYTHONPATH": os.pathsep.join(sys.path)}
        fleet = subprocess.Popen(command, env=environment)
        try:
            _measure(config, (columns, rows), settled_s, measured_s)
        finally:
            fleet.kill()
            fleet.wait()


def _measure(config: BusConfig, size: tuple[int, int], settled_s: float, measured_s: float) -> None:
    first, (columns, rows) = config.of(config.namespaces[0]), size
    with Bus.open(topics.OBSERVER, first) as bus:
        if bus.wait_for({topics.ROBOT_SIM}, START_S):
            sys.exit("the robots did not come up")
        terminal = Terminal(first, columns, rows, everyone=True)
        os.sched_setaffinity(terminal.pid, {max(os.sched_getaffinity(0))})
        try:
            if bus.wait_for({topics.CONSOLE}, START_S):
                sys.exit("the console did not come up")
            for name, key in VIEWS.items():
                terminal.press(key)
                time.sleep(settled_s)
                _print(f"{columns}×{rows} {name}", terminal, measured_s)
            stopped_ms = _stopped_ms(config, bus, terminal, settled_s)
            least, median, most = (float(np.quantile(stopped_ms, share)) for share in (0.0, 0.5, 1.0))
            print(f"{columns}×{rows} e pressed: robots stopped after {least:.0f}, {median:.0f} and {most:.0f} ms")
        finally:
            terminal.leave()


def _stopped_ms(config: BusConfig, bus: Bus, terminal: Terminal, settled_s: float) -> list[float]:
    """From the key of the emergency stop until each robot's status says that it is stopped."""
    inboxes = {name: bus.of(name).inbox([topics.STATUS], keep="latest") for name in config.namespaces}
    time.sleep(settled_s)
    took_ms: dict[str, float] = {}
    begun_s = time.monotonic()
    terminal.press("e")
    while len(took_ms) < len(inboxes) and time.monotonic() < begun_s + START_S:
        for name, inbox in inboxes.items():
            for _, status in inbox.messages():
                if isinstance(status, TraversalStatus) and status.state == TraversalStatus.ESTOPPED:
                    took_ms.setdefault(name, 1e3 * (time.monotonic() - begun_s))
        time.sleep(0.001)
    if len(took_ms) < len(inboxes):
        sys.exit(f"only {len(took_ms)} robots were stopped")
    return list(took_ms.values())


def _print(what: str, terminal: Terminal, measured_s: float) -> None:
    """Watch for a while: redraws a second, the share of a core, the time that each redraw took of it."""
    redraws, cpu_s, written, at_s = terminal.redraws, terminal.cpu_s(), terminal.written_bytes, time.monotonic()
    time.sleep(measured_s)
    took_s = time.monotonic() - at_s
    drawn, share = terminal.redraws - redraws, (terminal.cpu_s() - cpu_s) / took_s
    each_ms = 1e3 * share * took_s / max(drawn, 1)
    kilobytes = (terminal.written_bytes - written) / took_s / 1000
    rate = drawn / took_s
    print(f"{what:17} {rate:>4.1f} {100 * share:>9.0f} % {each_ms:>5.0f} ms {kilobytes:>8.0f}", flush=True)
