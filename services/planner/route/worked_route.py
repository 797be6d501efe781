"""Route with the work along it: the input of segments, speeds and output."""

from dataclasses import dataclass
from typing import NamedTuple

from touchline.schemas.messages import LeftOutStretch, PlannedCoverage
from touchline.services.planner.segments.section import Section


class WetCrossings(NamedTuple):
    """Number of crossings of wet paint by wheels and casters, and those of any order of the lines."""

    total: int
    unavoidable: int


NONE_WET = WetCrossings(0, 0)


@dataclass(frozen=True)
class WorkedRoute:
    """Sections in driving order, each beginning at the pose at which the last one ended.

    Attributes:
        sections: Ideal curve.
        wet: Crossings of wet paint along it.
        coverage: Coverage figures of areas.
        left_out: Obstructed stretches of lines.
    """

    sections: list[Section]
    wet: WetCrossings = NONE_WET
    coverage: tuple[PlannedCoverage, ...] = ()
    left_out: tuple[LeftOutStretch, ...] = ()
