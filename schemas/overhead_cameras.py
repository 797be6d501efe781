"""Several cameras overhead as data: what each sees of the ground, how it is off, and what hides robots from them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from touchline.schemas.given_angles import Angle
from touchline.schemas.spec import Spec

_Coordinate = Annotated[float, Field(ge=-10_000, le=10_000)]
_Outline = Annotated[tuple[tuple[_Coordinate, _Coordinate], ...], Field(min_length=3, max_length=100)]
_Velocity = Annotated[float, Field(ge=-10, le=10)]


class OverheadCamera(Spec):
    """One of several cameras; of those that see a robot, the one nearest to it tells its pose."""

    name: str = ""
    """Name for people."""
    x_m: _Coordinate
    """Place below it."""
    y_m: _Coordinate
    height_m: Annotated[float, Field(gt=0, le=1000)] = 3.0
    """Height above the ground."""
    view: _Outline
    """Corners of the ground that it sees, in the map frame."""
    off_x_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    """Error of its calibration: all its poses are off by so much."""
    off_y_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    off_rad: Angle = 0.0
    """All its poses are turned about the place below it by so much."""
    edge_factor: Annotated[float, Field(ge=1, le=100)] = 1.0
    """Factor on the white noise at the farthest corner of the view; it grows with the squared distance."""


class Hiding(Spec):
    """Something upright that hides robots behind it from cameras: a wall, or a person who walks."""

    name: str = ""
    """Name for people."""
    outline: _Outline
    """Corners in the map frame, when it comes."""
    height_m: Annotated[float, Field(gt=0, le=1000)] = 1.8
    start_s: Annotated[float, Field(ge=0, le=8.64e6)] = 0.0
    """Sim time at which it comes."""
    duration_s: Annotated[float, Field(gt=0, le=8.64e6)] | None = None
    """Time for which it is there; null: to the end."""
    x_mps: _Velocity = 0.0
    """Velocity at which it moves meanwhile."""
    y_mps: _Velocity = 0.0
