"""Contact patches of wheels and casters."""

from typing import NamedTuple


class GroundContact(NamedTuple):
    """The tread of a wheel or caster on the ground.

    Attributes:
        x_m, y_m: Its middle, in the body's frame.
        width_m: Of the tread.
        radius_m: Of the wheel.
        swivels: Whether it always rolls forward, as a caster does.
    """

    x_m: float
    y_m: float
    width_m: float
    radius_m: float
    swivels: bool = False
