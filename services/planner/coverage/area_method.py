"""What an area coverage method is as plan options name it."""

from collections.abc import Sequence
from typing import Protocol

from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS, UnknownPlugin
from touchline.schemas.template import Area


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
    name = options.area_method or AREA_METHODS.default
    try:
        found: AreaMethod = AREA_METHODS.find(name)
    except UnknownPlugin as error:
        known = ", ".join(AREA_METHODS.names())
        raise PlanningError("", f'asks for the unknown area method "{name}"', f"use one of: {known}") from error
    return found
