"""Bumper strips: data sheet of one in a vehicle's file."""

from typing import Annotated, Literal

from pydantic import Field

from touchline.schemas.vehicles.sensor_spec import SensorSpec

_Way = Annotated[float, Field(ge=0, le=100)]


class BumperStripSpec(SensorSpec):
    """Strip on a stretch of the outline; a vehicle with strips feels contacts there alone, any other all round.

    A measurement is the force on it [N]. The robot's computer has the bumper's state in every tick.
    """

    kind: Literal["bumper-strip"] = "bumper-strip"
    from_m: _Way
    """Begin of the stretch: way along the body's `footprint_m` from its first corner, in the order of the corners."""
    to_m: _Way
    """End of the stretch; less than `from_m` if it leads over the first corner."""
    least_n: Annotated[float, Field(ge=0, le=10_000)] = 20.0
    """Least force that presses it, mean over a tick (assumed)."""
