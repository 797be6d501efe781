"""Study of a network of robots: all tables, on many teams or on few."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from touchline_research.network.algorithms import algorithm_tables, algorithm_trials
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
        compared: Size of the team by which algorithms are compared.
        compared_share: Share of the time of those runs.
    """

    deployed: tuple[int, ...] = (10, 20, 50)
    swapped: tuple[int, ...] = (4, 8, 12, 20)
    seeds: int = 3
    paths: int = 800
    deploy_s: float = DEPLOY_S
    compared: int = 10
    compared_share: float = 1.0


FULL: Final = TeamCounts()
QUICK: Final = TeamCounts((10,), (4,), 1, 80, 40.0, 4, 0.3)


@dataclass(frozen=True)
class NetworkStudy:
    """Results: all tables, and for pictures the runs of teams that spread, and of algorithms that are compared."""

    tables: tuple[TargetTable, ...]
    deployed: tuple[TeamRecord, ...]
    compared: tuple[TeamRecord, ...] = ()


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
    compare = algorithm_trials(counts.compared, counts.seeds, counts.compared_share)
    whole, done = sum(map(_work, deploy + swap + compare)), 0.0

    def begins(trial: TeamTrial) -> None:
        nonlocal done
        rules = trial.rules
        progress(f"{trial.robots} robots {trial.task}, {rules.name}, {rules.avoid}, seed {trial.seed}", done / whole)
        done += _work(trial)

    deployed, swapped, compared = (run_trials(trials, begins) for trials in (deploy, swap, compare))
    tables = deployment_table(deployed), swap_table(swapped), speeds, *algorithm_tables(compared)
    return NetworkStudy(tables, tuple(deployed), tuple(compared))


def _work(trial: TeamTrial) -> float:
    """Relative duration of a run."""
    return trial.robots * trial.duration_s
