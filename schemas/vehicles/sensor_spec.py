"""Base class of auxiliary sensors in a vehicle's file: those beside positioning, IMU, magnetometer and encoders."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.quantities import Place


class SensorSpec(Spec):
    """Data sheet of an auxiliary sensor, as its maker and the robot's computer know it.

    Each kind adds fields, which only its own files read. A kind is registered in `SENSORS`.
    """

    kind: str
    name: Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
    """Name of this one, unique in the vehicle; faults and recordings use it."""
    rate_hz: Literal[1, 2, 4, 5, 10, 20, 25, 50, 100] = 10
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Time from a measurement to its arrival at the robot's computer."""
    x_m: Place = 0.0
    """Mounting place ahead of the axle's centre."""
    y_m: Place = 0.0
    """Mounting place to the left of it."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """A field of the kind."""
