"""Protection against contact with things in the way, by a vehicle's own sensors."""

from typing import Annotated, Literal

from pydantic import Field

from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.quantities import Acceleration


class Protection(Spec):
    """Rules by which a robot with a lidar slows down and stops; a robot without one has none to apply."""

    mode: Literal["protect", "passive"] = "passive"
    """`protect` takes all things as standing; `passive` allows for things that move at up to `thing_speed_mps`."""
    thing_speed_mps: Annotated[float, Field(ge=0, le=5)] = 1.5
    """Highest speed of a thing, with `passive` (a person who walks: ISO 13855 has 1.6 m/s)."""
    hard_braking_mps2: Acceleration | None = None
    """Deceleration of a protective stop; null: what drive and surface allow."""
    margin_m: Annotated[float, Field(ge=0, le=2)] = 0.05
    """Least distance that is kept."""
    unseen: Literal["occupied", "ignored"] = "ignored"
    """Ground that no beam has seen: behind things, and outside the lidar's field."""
