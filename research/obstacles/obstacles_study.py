"""Study of obstacles: all tables, at length or quick."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from touchline_research.obstacles.barn_figures import barn_table
from touchline_research.obstacles.protected_lines import LineRuns, drive_lines, protection_table
from touchline_research.obstacles.ways_to_goals import Trial, try_ways, ways_table
from touchline_research.target_table import TargetTable

Progress = Callable[[str, float], None]


class Extent(NamedTuple):
    """Extent of the measurements of each table.

    Attributes:
        lines: Number of lines by each rule among each crowd.
        worlds: Number of random worlds.
        goals: Number of goals in each.
        searches_s: Times that OMPL's BIT* is given.
    """

    lines: int = 100
    worlds: int = 12
    goals: int = 4
    searches_s: tuple[float, ...] = (3.0, 5.0)


FULL: Final = Extent()
QUICK: Final = Extent(5, 3, 1, (3.0,))


@dataclass(frozen=True)
class ObstaclesStudy:
    """Results: all tables, and the data of the pictures."""

    tables: tuple[TargetTable, ...]
    lines: tuple[LineRuns, ...]
    trials: tuple[Trial, ...]


def run_obstacles_study(extent: Extent = FULL, progress: Progress = lambda what, done: None) -> ObstaclesStudy:
    """Run the study.

    Args:
        extent: Extent of the measurements.
        progress: Called with the current measurement and the fraction of it that is done.
    """
    lines = drive_lines(extent.lines, lambda what, done: progress(what, 0.4 * done))
    trials = try_ways(
        extent.worlds, extent.goals, extent.searches_s, lambda what, done: progress(what, 0.4 + 0.6 * done)
    )
    tables = protection_table(lines), ways_table(trials, extent.searches_s), barn_table()
    return ObstaclesStudy(tables, tuple(lines), tuple(trials))
