"""Teams of emulated robots in one process: robots times real time on a core, memory a robot, the coordinator's part.

`python -m benchmarks fleet_scale`; `most` is the size of the largest team, `seconds` the sim time.
"""

import os
import time
from pathlib import Path

from benchmarks._settings import Small
from touchline.coordination.exchange import Exchange
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.team import TeamScenario

ROBOTS = (1, 10, 50, 200)
SMALL = Small(
    {"most": 10, "seconds": 1.0},
    (
        "a team that spreads, # s of sim time, one core; sessions hashed",
        "robots × real time robots × real time MB a robot coordinator, ms an update",
        *(f"{robots} # # # #" for robots in (1, 10)),
    ),
)


def main(most: int = 200, seconds: float = 20.0) -> None:
    """Print a row for each size of a team."""
    _run(2, seconds)  # compiles, or loads what is compiled
    print(f"a team that spreads, {seconds:g} s of sim time, one core; sessions hashed")
    heads = f"{'× real time':>11}  {'robots × real time':>18}  {'MB a robot':>10}  {'coordinator, ms an update':>25}"
    print(f"{'robots':>6}  {heads}")
    for robots in (robots for robots in ROBOTS if robots <= most):
        before_mb = _resident_mb()
        factor, update_ms, run = _run(robots, seconds)
        memory = (_resident_mb() - before_mb) / robots
        print(f"{robots:6}  {factor:11.1f}  {robots * factor:18.0f}  {memory:10.2f}  {update_ms:25.2f}")
        del run


def _run(robots: int, seconds: float) -> tuple[float, float, TeamRun]:
    """× real time, milliseconds of an exchange of messages with an update, and the run."""
    spent_s: list[float] = []

    def timed(self: Exchange, *arguments: object) -> object:
        begin = time.perf_counter()
        messages = exchange(self, *arguments)  # type: ignore[arg-type]
        spent_s.append(time.perf_counter() - begin)
        return messages

    exchange = Exchange.at
    Exchange.at = timed  # type: ignore[method-assign, assignment]
    try:
        begin = time.perf_counter()
        run = TeamRun(TeamScenario(robots=robots, duration_s=seconds), hashed=True)
        run.run()
        wall_s = time.perf_counter() - begin
    finally:
        Exchange.at = exchange  # type: ignore[method-assign]
    return run.ticks / 100.0 / wall_s, 1e3 * sum(spent_s) / len(spent_s), run


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
