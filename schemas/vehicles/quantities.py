"""Number types with bounds for the figures of a vehicle."""

from typing import Annotated

from pydantic import Field

# What is out of these bounds was meant in another unit, or is no robot that the physics' steps of 1 ms can follow.
Length = Annotated[float, Field(ge=0.001, le=10)]
Wheel = Annotated[float, Field(ge=0.02, le=2)]
Track = Annotated[float, Field(ge=0.05, le=10)]
Place = Annotated[float, Field(ge=-10, le=10)]
BodyPoint = tuple[Place, Place]
Mass = Annotated[float, Field(ge=1, le=10_000)]
WheelRate = Annotated[float, Field(ge=0.1, le=1_000)]
WheelAcceleration = Annotated[float, Field(ge=0.1, le=10_000)]
Acceleration = Annotated[float, Field(ge=0.01, le=100)]
Delay = Annotated[float, Field(ge=0, le=10)]
Speed = Annotated[float, Field(ge=0.05, le=20)]
