"""Angles that people give: in radians, and within a full turn, so that degrees are not taken for radians."""

import math
from typing import Annotated, Final

from pydantic import AfterValidator, Field

from touchline.schemas.errors import SpecError

FULL_TURN_RAD: Final = 2.0 * math.pi + 1e-9
"""With room for what rounding adds."""
Angle = Annotated[float, Field(ge=-FULL_TURN_RAD, le=FULL_TURN_RAD)]
"""Counter-clockwise, rad."""


def instead_of_degrees(degrees: float) -> str:
    """Remedy for an angle that was given in degrees: ``in radians, not degrees: 3.14159``."""
    turned = degrees if abs(degrees) <= 360.0 else math.remainder(degrees, 360.0)
    return f"in radians, not degrees: {math.radians(turned):.6g}"


def given_angle(option: str, angle_rad: float) -> float:
    """The angle that an option is given.

    Raises:
        SpecError: It is no angle within a full turn.
    """
    if not abs(angle_rad) <= FULL_TURN_RAD:
        remedy = f"give it {instead_of_degrees(angle_rad)}" if math.isfinite(angle_rad) else "give radians"
        raise SpecError("command line", option, f"is {angle_rad:g}", remedy)
    return angle_rad


def _within_a_turn(angle_rad: float) -> float:
    if abs(angle_rad) > FULL_TURN_RAD and math.isfinite(angle_rad):
        raise ValueError(f"give it {instead_of_degrees(angle_rad)}")
    return angle_rad


AngleOrAny = Annotated[float, AfterValidator(_within_a_turn)]
"""Counter-clockwise, rad; NaN: any."""
