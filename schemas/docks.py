"""Docks: where emulated robots charge."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.spec import Spec

_Coordinate = Annotated[float, Field(ge=-10000, le=10000)]


class DockSpec(Spec):
    """Dock: charges a robot that stands within `reach_m` of it."""

    x_m: _Coordinate
    """East."""
    y_m: _Coordinate
    """North."""
    power_w: Annotated[float, Field(gt=0, le=100_000)] = 60.0
    """Power into the battery."""
    reach_m: Annotated[float, Field(gt=0, le=1)] = 0.15
    """Distance within which a robot that stands is charged."""
