"""Study of cubic paths and trajectory tracking: all tables, on many goals or on few."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from touchline_research.target_table import TargetTable
from touchline_research.tracking.attraction import Domain, attraction, domains
from touchline_research.tracking.dubins_speeds import dubins_speeds
from touchline_research.tracking.least_times import least_times
from touchline_research.tracking.tracker_runs import disturbed, set_up_of_the_study
from touchline_research.tracking.winding import winding

Progress = Callable[[str, float], None]


class Counts(NamedTuple):
    """Extent of the measurements of each table.

    Attributes:
        anywhere: Number of goals for the minimum times.
        ahead: Number of goals for the winding.
        tracked: Number of goals for the trackers.
        paths: Number of Dubins paths for the speed laws.
        headings: Number of initial headings for the domains of attraction.
        offsets: Number of initial offsets for them.
    """

    anywhere: int = 600
    ahead: int = 300
    tracked: int = 25
    paths: int = 800
    headings: int = 25
    offsets: int = 9


FULL: Final = Counts()
QUICK: Final = Counts(60, 60, 5, 80, 9, 3)


@dataclass(frozen=True)
class TrackingStudy:
    """Results: all tables, and the data of the plots."""

    tables: tuple[TargetTable, ...]
    domains: Mapping[str, Domain]


def run_tracking_study(counts: Counts = FULL, progress: Progress = lambda what, done: None) -> TrackingStudy:
    """Run the study.

    Args:
        counts: Extent of the measurements.
        progress: Called with the current measurement and the fraction of it that is done.
    """
    progress("least times", 0.0)
    tables = [least_times(counts.anywhere)]
    progress("turning", 0.15)
    tables.append(winding(counts.ahead))
    progress("the study's set-up", 0.2)
    tables.append(set_up_of_the_study(counts.tracked))
    progress("trackers", 0.35)
    tables.append(disturbed(counts.tracked))
    progress("domains of attraction", 0.6)
    found = domains(counts.headings, counts.offsets)
    tables.append(attraction(found))
    progress("speed laws", 0.9)
    tables.append(dubins_speeds(counts.paths))
    return TrackingStudy(tuple(tables), found)
