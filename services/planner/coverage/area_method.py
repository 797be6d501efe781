"""What an area coverage method is as plan options name it."""

from collections.abc import Sequence
from typing import Protocol

from touchline.schemas.curves import Curve
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS
from touchline.schemas.template import Area
from touchline.services.planner.chosen_plugin import chosen


class AreaMethod(Protocol):
    """How an area is covered, registered in `AREA_METHODS`: a function."""

    def __call__(self, area: Area, width_m: float, /) -> Sequence[Curve]:
        """The lines and arcs along which the tool covers an area, in the order and directions that suit best.

        Args:
            area: In the map frame; its outline and holes are simple polygons.
            width_m: What the tool covers across its way (m); the area is at some place as wide.
        """


def area_method_of(options: PlanOptions) -> AreaMethod:
    """The area method that the options name; "" is the default one.

    Raises:
        PlanningError: There is no such method.
    """
    found: AreaMethod = chosen(AREA_METHODS, options.area_method, "area method")
    return found
