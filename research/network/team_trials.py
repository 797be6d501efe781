"""Trials of teams by the study's rules or by ours, from the same starts, and their records."""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from touchline.coordination.free_area import FreeArea
from touchline.coordination.tasks import ARRIVED_M
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import BELIEVED_M, TeamRun, TeamTrace
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import AlgorithmChoice, DeployTask, SwapTask, TeamArea, TeamScenario

Avoid = Literal["cells", "plans", "barriers", "none"]

DEPLOY_S, SWAP_S = 120.0, 60.0
APART_M: Final = 1.3
"""Distance of scattered robots."""


class TeamRules(NamedTuple):
    """Rules of a team, as in `TeamScenario`; `ours` have targets.

    Attributes:
        name: Name in tables and pictures.
        avoid: What keeps robots apart.
        path: Heading at the goals of the study's paths.
        use: Algorithm that decides where robots drive; "": the task does.
    """

    name: str
    avoid: Avoid
    path: Literal["bearing", "free"] = "bearing"
    use: str = ""

    @property
    def ours(self) -> bool:
        """True for what keeps robots apart by our rules."""
        return self.avoid != "none"


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
        scattered: True: robots start all over the area, in any order; else in a corner, or on a circle.
    """

    rules: TeamRules
    robots: int
    seed: int
    task: Literal["deploy", "swap"] = "deploy"
    duration_s: float = DEPLOY_S
    scattered: bool = False

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
            algorithm=AlgorithmChoice(use=self.rules.use) if self.rules.use else None,
            duration_s=self.duration_s,
        )
        if self.scattered:
            team = team.model_copy(update=_scattered(self.robots, self.seed))
        run = TeamRun(team.model_copy(update={"world": team.world.model_copy(update={"seed": self.seed})}))
        run.run()
        figures = team_figures(run, time.perf_counter() - begun)
        return TeamRecord(self, figures, run.trace, run.area, run.body_radius_m, _arrivals(run))


def _scattered(robots: int, seed: int) -> dict[str, Any]:
    """Places on a grid in any order, and the area round it."""
    across = math.ceil(math.sqrt(robots))
    order = np.random.default_rng(seed).permutation(robots).tolist()
    side_m = APART_M * (across + 0.5)
    places = {
        f"tb{k + 1}": Pose2(x_m=APART_M * (at % across + 0.75), y_m=APART_M * (at // across + 0.75), heading_rad=0.0)
        for k, at in enumerate(order)
    }
    outline = ((0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m))
    return {"places": places, "area": TeamArea(outline=outline)}


def _arrivals(run: TeamRun) -> tuple[float, ...]:
    """Time at which each robot has come to its last goal for good (s); that of the end, if it never has."""
    goals, times_s = run.task.last, np.array([*run.trace.times_s, run.trace.ended_s])
    places = np.array(run.trace.places)
    found = []
    for number, name in enumerate(run.names):
        if name in goals:
            away = np.flatnonzero(np.hypot(*(places[:, number] - goals[name]).T) > ARRIVED_M + BELIEVED_M)
            found.append(float(times_s[int(away[-1]) + 1]) if len(away) else 0.0)
    return tuple(found)


class TeamRecord(NamedTuple):
    """Record of a run.

    Attributes:
        trial: Parameters of the run.
        figures: Figures by `team_figures`.
        trace: States over time.
        area: Area of the team.
        body_radius_m: Radius of each robot's body.
        arrivals_s: Time at which each robot has come to its last goal; empty without goals.
    """

    trial: TeamTrial
    figures: dict[str, Any]
    trace: TeamTrace
    area: FreeArea
    body_radius_m: float
    arrivals_s: tuple[float, ...] = ()


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
