"""The estimator alone on a recorded session: how many times real time, and what of it is reading.

`python -m benchmarks check_estimator`; `session` names the recording, by default a pitch is simulated first. All is
processor time, the best of `repeats`. Reading message by message, twice, as the check once did, is beside reading
once into tables.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks._settings import Small
from touchline.checking.check_session import check_recording
from touchline.checking.component_replay import OPEN_LOOP
from touchline.checking.divergence import ESTIMATOR
from touchline.checking.robot_messages import RobotMessages
from touchline.checking.robot_tables import RobotTables
from touchline.recordings.reader import RecordingReader
from touchline.services.robot_sim.warm_up import warm_up

SMALL = Small(
    {"template": "study-square", "repeats": 1},
    (
        "study-square.mcap: # s of sim time; # estimates compared: the same",
        *(
            f"{what} # s # times real time"
            for what in (
                "read message by message, twice",
                "read once into tables",
                "the whole check",
                "the command, with its start",
            )
        ),
    ),
)


def main(session: str = "", template: str = "soccer-11", repeats: int = 3) -> None:
    """Run the benchmark, and print its figures."""
    if session:
        measure(Path(session), repeats)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{template}.mcap"
        subprocess.run([sys.executable, "-m", "touchline", "simulate", template, "--record", str(path)], check=True)
        measure(path, repeats)


def measure(path: Path, repeats: int) -> None:
    """Print the figures of a recording of one robot."""
    warm_up(print)
    (found,) = check_recording(path, only=ESTIMATOR)
    verdict = found.problem or ("the same" if found.passed else str(found.first))
    pairs = sum(each.pairs for each in found.diff.topics.values())
    print(f"{path.name}: {found.sim_time_s:.0f} s of sim time; {pairs:,} estimates compared: {verdict}")
    for what, task in (
        ("read message by message, twice", lambda: by_message(path, found.robot)),
        ("read once into tables", lambda: RobotTables(path, OPEN_LOOP)),
        ("the whole check", lambda: check_recording(path, only=ESTIMATOR)),
    ):
        spent_s = min(cpu_s(task) for _ in range(repeats))
        print(f"  {what:32s}{spent_s:7.2f} s{found.sim_time_s / spent_s:10,.0f} times real time")
    begun_s = sum(_children_s())
    subprocess.run(
        [sys.executable, "-m", "touchline", "check", "--estimator-only", str(path)],
        stdout=subprocess.DEVNULL,
        check=True,
    )
    spent_s = sum(_children_s()) - begun_s
    print(f"  {'the command, with its start':32s}{spent_s:7.2f} s{found.sim_time_s / spent_s:10,.0f} times real time")


def by_message(path: Path, robot: str) -> None:
    """Read once to know what there is, and once more for the messages."""
    for _ in RecordingReader(path).messages([]):
        pass
    for _ in RobotMessages(path, robot).of(OPEN_LOOP):
        pass


def cpu_s(task: Callable[[], object]) -> float:
    """Processor time of it."""
    begun = time.process_time()
    task()
    return time.process_time() - begun


def _children_s() -> tuple[float, float]:
    times = os.times()
    return times.children_user, times.children_system
