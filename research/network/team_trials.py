"""Trials of teams by the study's rules or by ours, from the same starts, and their records."""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Literal, NamedTuple

from touchline.coordination.free_area import FreeArea
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun, TeamTrace
from touchline.schemas.team import DeployTask, SwapTask, TeamScenario

DEPLOY_S, SWAP_S = 120.0, 60.0


class TeamRules(NamedTuple):
    """Rules of a team, as in `TeamScenario`; `ours` have targets."""

    name: str
    avoid: Literal["cells", "none"]
    path: Literal["bearing", "free"] = "bearing"

    @property
    def ours(self) -> bool:
        """True for our rules, false for the study's."""
        return self.avoid == "cells"


BEARING: Final = TeamRules("study: Dubins to the bearing", "none")
FREE: Final = TeamRules("study: Dubins, free heading", "none", "free")
OURS: Final = TeamRules("ours: cells of stopping segments", "cells")


class TeamTrial(NamedTuple):
    """Parameters of a run.

    Attributes:
        rules: Rules of the team.
        robots: Number of robots.
        seed: Seed of noise and starts.
        task: `deploy` or `swap`.
        duration_s: Sim time; a swap ends when all have arrived.
    """

    rules: TeamRules
    robots: int
    seed: int
    task: Literal["deploy", "swap"] = "deploy"
    duration_s: float = DEPLOY_S

    def run(self) -> "TeamRecord":
        """Run the trial.

        Raises:
            TouchlineError: The team cannot drive.
        """
        begun = time.perf_counter()
        team = TeamScenario(
            robots=self.robots,
            task=DeployTask() if self.task == "deploy" else SwapTask(kind="swap"),
            avoid=self.rules.avoid,
            path=self.rules.path,
            duration_s=self.duration_s,
        )
        run = TeamRun(team.model_copy(update={"world": team.world.model_copy(update={"seed": self.seed})}))
        run.run()
        figures = team_figures(run, time.perf_counter() - begun)
        return TeamRecord(self, figures, run.trace, run.area, run.body_radius_m)


class TeamRecord(NamedTuple):
    """Record of a run.

    Attributes:
        trial: Parameters of the run.
        figures: Figures by `team_figures`.
        trace: States over time.
        area: Area of the team.
        body_radius_m: Radius of each robot's body.
    """

    trial: TeamTrial
    figures: dict[str, Any]
    trace: TeamTrace
    area: FreeArea
    body_radius_m: float


def trials_of(
    sizes: Sequence[int], rules: Sequence[TeamRules], seeds: int, task: Literal["deploy", "swap"], duration_s: float
) -> list[TeamTrial]:
    """Combine all sizes, rules and seeds from 1 on."""
    return [
        TeamTrial(each, robots, seed, task, duration_s)
        for robots in sizes
        for each in rules
        for seed in range(1, seeds + 1)
    ]


def run_trials(trials: Iterable[TeamTrial], progress: Callable[[TeamTrial], None]) -> list[TeamRecord]:
    """Run trials one after the other.

    Args:
        trials: Trials to run.
        progress: Called with each trial before it begins.
    """
    records = []
    for trial in trials:
        progress(trial)
        records.append(trial.run())
    return records


def by_team(records: Iterable[TeamRecord]) -> list[list[TeamRecord]]:
    """Group records that differ only in their seeds, in their order."""
    groups: dict[tuple[TeamRules, int], list[TeamRecord]] = {}
    for record in records:
        groups.setdefault((record.trial.rules, record.trial.robots), []).append(record)
    return list(groups.values())


def listed(values: Sequence[float], form: str, unit: str = "") -> str:
    """Format values of several seeds: all of them if they are few, else minimum and maximum.

    Args:
        values: At least one value.
        form: Format of each.
        unit: Unit after the last.
    """
    texts = [format(value, form) for value in values]
    if len(set(texts)) == 1:
        return texts[0] + unit
    if len(texts) <= 3:
        return ", ".join(texts) + unit
    return f"{format(min(values), form)} to {format(max(values), form)}{unit}"
