"""Operators who come, ask and leave while a robot drives and is recorded; then it is stopped.

`python -m benchmarks visits`; `runs` is the number of visits. Ends with exit code 1 if the stop comes late
(by how much, `slack` multiplies), a service has died, the recording is not whole, or memory, threads or descriptors
have grown with the visits.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import Final, NamedTuple

from benchmarks._observer import Observer
from benchmarks._processes import NODES, Figures, figures
from benchmarks._recordings import verdict
from benchmarks._settings import Small
from benchmarks._strangers import ROOT
from benchmarks._system import Hand, System, SystemLost, new_id, running_system
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import CommandRequest

_LIMIT_S: Final = 0.3
_PATIENCE_S: Final = 30.0
_ROUND: Final = 50
"""Visits by one process, after which there is a line of figures and another process."""
_GROWTH_MB: Final = 15.0
_GROWTH: Final = 5
"""Threads or descriptors."""
SMALL: Final = Small(
    {"runs": 2, "template": "tennis", "slack": 100.0},
    (
        f"visits in vain {' '.join(NODES)} MB / threads / descriptors",
        "# 0 # / # / # # / # / # # / # / #",
        "emergency stop after all visits: # ms",
    ),
)


def main(runs: int = 1000, template: str = "soccer-11", slack: float = 1.0) -> None:
    """Visit, and print the figures after every fifty."""
    with running_system() as system, Bus.open("observer", system.config) as bus:
        try:
            problems = _visited(system, bus, _Visits(runs, template, _LIMIT_S * slack))
        except SystemLost as lost:
            problems = [f"the system was lost: {lost}"]
    for problem in problems:
        print(f"  BAD: {problem}")
    if problems:
        sys.exit(1)


class _Visits(NamedTuple):
    """Number of visits, the template that is painted meanwhile, and the time within which the robot has to stop (s)."""

    runs: int
    template: str
    limit_s: float


def _visited(system: System, bus: Bus, asked: _Visits) -> list[str]:
    hand, observer = Hand(system, bus), Observer(bus)
    hand.ready()
    hand.drive(asked.template)
    recording = system.recordings / "visits.mcap"
    problems = [f"no recording: {problem}"] if (problem := hand.record(recording)) else []
    before = system.processes()
    print(
        f"{'visits':>6} {'in vain':>7}  " + "  ".join(f"{name:>24}" for name in NODES) + "   MB / threads / descriptors"
    )
    rounds: list[dict[str, Figures]] = []
    in_vain = done = 0
    while done < asked.runs:
        count = min(_ROUND, asked.runs - done)
        in_vain += _visit(system, count)
        done += count
        observer.watch(0.5)
        system.check()
        rounds.append({name: held for name, pid in before.items() if (held := figures(pid)) is not None})
        cells = [_cell(rounds[-1].get(name)) for name in NODES]
        print(f"{done:6d} {in_vain:7d}  " + "  ".join(f"{cell:>24}" for cell in cells), flush=True)
    if in_vain:
        problems.append(f"{in_vain} visitors were not answered")
    problems += [f"{name} died" for name in NODES if system.processes().get(name) != before[name]]
    problems += _stop(bus, observer, asked.limit_s)
    if problem := hand.finish_recording():
        problems.append(f"recording: {problem}")
    problems += [f"in the recording: {problem}" for problem in verdict(recording).problems]
    for name in before:
        if name in rounds[0] and name in rounds[-1]:
            problems += _grown(name, rounds[0][name], rounds[-1][name])
    return problems


def _visit(system: System, times: int) -> int:
    """Come, ask how the robot is, leave, so often; how often in vain."""
    visitor = subprocess.run(
        [sys.executable, "-m", "benchmarks._visitor", str(times)],
        cwd=ROOT,
        env={**os.environ, **system.environment},
        stdout=subprocess.PIPE,
        check=True,
    )
    return int(visitor.stdout)


def _stop(bus: Bus, observer: Observer, limit_s: float) -> list[str]:
    """True if the robot can still be stopped."""
    observer.poll()
    sent_s = time.monotonic()
    problems = []
    try:
        bus.call(topics.ESTOP, CommandRequest(request_id=new_id()))
    except TouchlineError as error:
        problems.append(f"no emergency stop: {error}")
    while observer.estopped_s is None and time.monotonic() < sent_s + _PATIENCE_S:
        observer.watch(0.01)
    if observer.estopped_s is None:
        return [*problems, "the emergency stop did not reach the robot"]
    took_s = observer.estopped_s - sent_s
    print(f"emergency stop after all visits: {1e3 * took_s:.0f} ms")
    return problems if took_s <= limit_s else [*problems, f"the emergency stop took {took_s:.2f} s"]


def _grown(name: str, first: Figures, last: Figures) -> list[str]:
    grown = []
    if last.memory_mb - first.memory_mb > _GROWTH_MB:
        grown.append(f"{name} has grown from {first.memory_mb:.0f} to {last.memory_mb:.0f} MB")
    for what, before, after in (("threads", first[1], last[1]), ("descriptors", first[2], last[2])):
        if after - before > _GROWTH:
            grown.append(f"{name} has gone from {before} to {after} {what}")
    return grown


def _cell(held: Figures | None) -> str:
    return "-" if held is None else f"{held.memory_mb:.1f} / {held.threads} / {held.descriptors}"
