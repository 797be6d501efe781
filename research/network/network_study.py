"""Study of a network of robots: all tables, on many teams or on few."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from touchline_research.network.deployments import deployment_table
from touchline_research.network.swaps import swap_table
from touchline_research.network.team_trials import (
    BEARING,
    DEPLOY_S,
    FREE,
    OURS,
    SWAP_S,
    TeamRecord,
    TeamTrial,
    run_trials,
    trials_of,
)
from touchline_research.target_table import TargetTable
from touchline_research.tracking.dubins_speeds import dubins_speeds

Progress = Callable[[str, float], None]


class TeamCounts(NamedTuple):
    """Extent of the measurements of each table.

    Attributes:
        deployed: Sizes of teams that spread.
        swapped: Sizes of teams that change places.
        seeds: Number of seeds of each team.
        paths: Number of Dubins paths for the speed laws.
        deploy_s: Sim time of each run of a team that spreads.
    """

    deployed: tuple[int, ...] = (10, 20, 50)
    swapped: tuple[int, ...] = (4, 8, 12, 20)
    seeds: int = 3
    paths: int = 800
    deploy_s: float = DEPLOY_S


FULL: Final = TeamCounts()
QUICK: Final = TeamCounts((10,), (4,), 1, 80, 40.0)


@dataclass(frozen=True)
class NetworkStudy:
    """Results: all tables, and the runs of teams that spread, for pictures."""

    tables: tuple[TargetTable, ...]
    deployed: tuple[TeamRecord, ...]


def run_network_study(counts: TeamCounts = FULL, progress: Progress = lambda what, done: None) -> NetworkStudy:
    """Run the study.

    Args:
        counts: Extent of the measurements.
        progress: Called with the current measurement and the fraction of it that is done.

    Raises:
        TouchlineError: A team cannot drive.
    """
    progress("speed laws", 0.0)
    speeds = dubins_speeds(counts.paths)
    deploy = trials_of(counts.deployed, (BEARING, FREE, OURS), counts.seeds, "deploy", counts.deploy_s)
    swap = trials_of(counts.swapped, (BEARING, OURS), counts.seeds, "swap", SWAP_S)
    whole, done = sum(map(_work, deploy + swap)), 0.0

    def begins(trial: TeamTrial) -> None:
        nonlocal done
        progress(f"{trial.robots} robots {trial.task}, {trial.rules.name}, seed {trial.seed}", done / whole)
        done += _work(trial)

    deployed, swapped = run_trials(deploy, begins), run_trials(swap, begins)
    return NetworkStudy((deployment_table(deployed), swap_table(swapped), speeds), tuple(deployed))


def _work(trial: TeamTrial) -> float:
    """Relative duration of a run."""
    return trial.robots * trial.duration_s
