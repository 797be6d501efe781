"""`fleet()`: a team of emulated robots that share an area."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.api.given_arguments import Progress, no_progress
from touchline.core.stopwatch import Stopwatch
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.jobs.task_pool import cores
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.spec import parse, read_text
from touchline.schemas.team import TeamScenario
from touchline.schemas.topics import TEAM_NAMESPACE


@dataclass(frozen=True, repr=False)
class FleetRun:
    """Finished run of a team.

    Attributes:
        names: Names of the robots.
        success: True if it did its task without contact.
        reason: Why not, or empty.
        report: All figures, as `touchline fleet simulate` prints them.
        time_s: (k,) times of the updates.
        place_m: (k, n, 2) true places of the robots then, map frame.
    """

    names: tuple[str, ...]
    success: bool
    reason: str
    report: Mapping[str, Any]
    time_s: NDArray[np.float64]
    place_m: NDArray[np.float64]

    def __repr__(self) -> str:
        """One line: robots and outcome."""
        return f"FleetRun({len(self.names)} robots, {'done' if self.success else self.reason})"


def fleet(
    team: TeamScenario | str | Path | int = 10,
    /,
    *,
    seed: int | None = None,
    record: str | Path | None = None,
    hashed: bool = False,
    progress: Progress | None = None,
) -> FleetRun:
    """Simulate a team, in lockstep and in this process.

    Args:
        team: Team, its file (`touchline fleet team` prints one), or a number of robots.
        seed: Seed of all noise; None: the team's.
        record: MCAP file to write.
        hashed: True: the hashes of the sessions are computed.
        progress: Called with the fraction done and the present step.

    Raises:
        SpecError: The team cannot be, such as too many robots for the area.
        CommandRefused: Such a robot cannot be guided.
    """
    chosen = _team(team)
    if seed is not None:
        chosen = chosen.replace("world.seed", seed)
    watch = Stopwatch()
    with PayloadRecorder(Path(record) if record is not None else None, (*chosen.names, TEAM_NAMESPACE)) as recorder:
        listener = recorder.hear if record is not None else None
        run = TeamRun(chosen, hashed=hashed, listener=listener, threads=cores())
        run.run(progress or no_progress)
    figures = team_figures(run, watch.elapsed_s) | recorder.as_figure()
    places = np.array(run.trace.places).reshape(-1, len(run.names), 2)
    times = np.array(run.trace.times_s)
    return FleetRun(tuple(run.names), figures["success"], figures["reason"], figures, times, places)


def _team(given: TeamScenario | str | Path | int) -> TeamScenario:
    if isinstance(given, TeamScenario):
        return given
    if isinstance(given, int):
        return TeamScenario().replace("robots", given)
    return parse(TeamScenario, read_text(Path(given)), Path(given).name)
