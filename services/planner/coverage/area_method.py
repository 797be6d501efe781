"""The interface of area coverage methods, and their choice by name."""

from collections.abc import Sequence
from typing import Protocol

from touchline.schemas.curves import Curve
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS
from touchline.schemas.template import Area
from touchline.services.planner.chosen_plugin import chosen


class AreaMethod(Protocol):
    """A function that covers an area with swaths, registered in `AREA_METHODS`."""

    def __call__(self, area: Area, width_m: float, /) -> Sequence[Curve]:
        """The lines and arcs along which the tool covers an area, in the order and directions that suit best.

        Args:
            area: In the map frame; its outline and holes are simple polygons.
            width_m: Width of what the tool covers (m); the area is as wide somewhere.
        """


def area_method_of(options: PlanOptions) -> AreaMethod:
    """The area method that the options name; "" is the default one.

    Raises:
        PlanningError: There is no such method.
    """
    found: AreaMethod = chosen(AREA_METHODS, options.area_method, "area method")
    return found
