"""The route with what is known of the work along it: what the stages before hand to those behind."""

from dataclasses import dataclass
from typing import NamedTuple

from touchline.schemas.messages import LeftOutStretch, PlannedCoverage
from touchline.services.planner.segments.section import Section


class WetCrossings(NamedTuple):
    """How often a wheel or caster meets wet paint, and how often it does so in any order of the lines."""

    total: int
    unavoidable: int


NONE_WET = WetCrossings(0, 0)


@dataclass(frozen=True)
class WorkedRoute:
    """Sections in driving order, each beginning at the pose at which the last one ended.

    Attributes:
        sections: The ideal curve.
        wet: Crossings of wet paint along it.
        coverage: Of areas.
        left_out: Stretches of lines that outlines are in the way of.
    """

    sections: list[Section]
    wet: WetCrossings = NONE_WET
    coverage: tuple[PlannedCoverage, ...] = ()
    left_out: tuple[LeftOutStretch, ...] = ()
