"""Study of obstacles: all tables, at length or quick."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from touchline_research.obstacles.protected_lines import LineRuns, drive_lines, protection_table
from touchline_research.target_table import TargetTable

Progress = Callable[[str, float], None]


class Extent(NamedTuple):
    """Extent of the measurements of each table.

    Attributes:
        lines: Number of lines by each rule among each crowd.
    """

    lines: int = 100


FULL: Final = Extent()
QUICK: Final = Extent(5)


@dataclass(frozen=True)
class ObstaclesStudy:
    """Results: all tables, and the data of the pictures."""

    tables: tuple[TargetTable, ...]
    lines: tuple[LineRuns, ...]


def run_obstacles_study(extent: Extent = FULL, progress: Progress = lambda what, done: None) -> ObstaclesStudy:
    """Run the study.

    Args:
        extent: Extent of the measurements.
        progress: Called with the current measurement and the fraction of it that is done.
    """
    lines = drive_lines(extent.lines, progress)
    return ObstaclesStudy((protection_table(lines),), tuple(lines))
