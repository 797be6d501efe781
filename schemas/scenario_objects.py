"""Objects of a scenario: things and living beings that stand, move or roll on the ground, with default shapes."""

import math
from collections.abc import Mapping
from typing import Annotated, Final, Literal, NamedTuple, Self

from pydantic import AfterValidator, Field, model_validator

from touchline.schemas.given_angles import Angle
from touchline.schemas.misfit import misfit
from touchline.schemas.spec import Spec

Kind = Literal["post", "goal", "bench", "wall", "tree", "grass", "machine", "person", "dog", "ball"]
Surface = Literal["light", "dark"]
Coordinate = Annotated[float, Field(ge=-10000, le=10000)]
Offset = Annotated[float, Field(ge=-200, le=200)]
Corner = tuple[Offset, Offset]
_Place = tuple[Coordinate, Coordinate]
_WalkingSpeed = Annotated[float, Field(gt=0, le=5)]
_Time = Annotated[float, Field(ge=0, le=8.64e6)]


def _simple(corners: tuple[Corner, ...] | None) -> tuple[Corner, ...] | None:
    import shapely  # here: it takes a tenth of a second, and few scenarios have objects

    if corners is not None:
        outline = shapely.Polygon(corners)
        if not outline.is_valid or outline.area < 1e-6:
            raise ValueError("an outline must have an area and must not cross or touch itself")
    return corners


class Still(Spec):
    """Stays where it is until it is pushed."""

    kind: Literal["still"] = "still"


class FollowPath(Spec):
    """Goes from the object's place to each of its points in turn, straight and evenly."""

    kind: Literal["path"]
    points: Annotated[tuple[_Place, ...], Field(min_length=1, max_length=100)]
    """Points to go to, map frame."""
    speed_mps: _WalkingSpeed = 1.2
    start_s: _Time = 0.0
    """Sim time at which it sets off."""
    loop: bool = False
    """After the last point it goes on to the first."""


class Wander(Spec):
    """Goes to random points of a rectangle, one after another."""

    kind: Literal["wander"]
    corner: _Place
    """South-west corner of the rectangle, map frame."""
    opposite: _Place
    """North-east corner."""
    speed_mps: _WalkingSpeed = 1.0

    @model_validator(mode="after")
    def _has_an_inside(self) -> Self:
        if self.opposite[0] < self.corner[0] or self.opposite[1] < self.corner[1]:
            raise misfit("opposite", self.opposite, "give the north-east corner: east and north of `corner`")
        return self


class StepInFront(Spec):
    """Waits until the robot is near, then crosses its way ahead of it and stays on the other side."""

    kind: Literal["step-in-front"]
    near_m: Annotated[float, Field(gt=0, le=50)] = 3.0
    """Distance from the robot's origin at which it sets off."""
    ahead_m: Annotated[float, Field(ge=0, le=50)] = 1.5
    """It aims so far ahead of the robot's origin, in the direction of travel."""
    beyond_m: Annotated[float, Field(ge=0, le=50)] = 3.0
    """It goes on so far beyond that point."""
    speed_mps: _WalkingSpeed = 1.2


class Intercept(Spec):
    """Walks at the robot as long as that is near, and presses against it."""

    kind: Literal["intercept"]
    near_m: Annotated[float, Field(gt=0, le=10000)] = 15.0
    """Distance from the robot's origin within which it walks."""
    start_s: _Time = 0.0
    speed_mps: _WalkingSpeed = 1.2


Motion = Annotated[Still | FollowPath | Wander | StepInFront | Intercept, Field(discriminator="kind")]


class KindDefaults(NamedTuple):
    """Figures of a kind of object, assumed unless a field of the object says otherwise.

    Attributes:
        radius_m: Radius of a disc; 0: the kind has an outline.
        outline: Corners in the object's frame.
        height_m: Height above the ground.
        mass_kg: Mass of what can be pushed; 0: it is fixed to the ground.
        hold_mps2: Largest acceleration by its own feet, or deceleration as it rolls.
        surface: Light or dark, for lidars.
        soft: True if it yields without pressing a bumper.
    """

    radius_m: float
    outline: tuple[Corner, ...]
    height_m: float
    mass_kg: float
    hold_mps2: float
    surface: Surface
    soft: bool


def _box(length_m: float, width_m: float) -> tuple[Corner, ...]:
    x, y = 0.5 * length_m, 0.5 * width_m
    return ((-x, -y), (x, -y), (x, y), (-x, y))


def _goal_frame() -> tuple[Corner, ...]:
    """Return the outline of a football goal on the ground: two posts, side bars, and the bar behind; open ahead."""
    half, deep, bar = 3.66, 2.0, 0.12
    outer, inner = half + bar, half
    back = deep - 0.05
    return (
        (0.0, -outer),
        (0.0, -inner),
        (-back, -inner),
        (-back, inner),
        (0.0, inner),
        (0.0, outer),
        (-deep, outer),
        (-deep, -outer),
    )


KIND_DEFAULTS: Final[Mapping[Kind, KindDefaults]] = {
    "post": KindDefaults(0.06, (), 2.0, 0.0, 3.0, "light", soft=False),
    "goal": KindDefaults(0.0, _goal_frame(), 2.44, 0.0, 3.0, "light", soft=False),
    "bench": KindDefaults(0.0, _box(2.0, 0.4), 0.45, 0.0, 3.0, "light", soft=False),
    "wall": KindDefaults(0.0, _box(4.0, 0.15), 2.0, 0.0, 3.0, "light", soft=False),
    "tree": KindDefaults(0.2, (), 8.0, 0.0, 3.0, "dark", soft=False),
    "grass": KindDefaults(0.15, (), 0.25, 0.0, 3.0, "dark", soft=True),
    "machine": KindDefaults(0.0, _box(3.0, 1.6), 1.8, 0.0, 3.0, "light", soft=False),
    "person": KindDefaults(0.2, (), 1.7, 75.0, 2.0, "dark", soft=False),
    "dog": KindDefaults(0.15, (), 0.5, 25.0, 3.0, "dark", soft=False),
    "ball": KindDefaults(0.11, (), 0.22, 0.43, 0.5, "light", soft=True),
}


class ScenarioObject(Spec):
    """An object on the ground: of its kind's shape and figures where they are not given."""

    kind: Kind
    name: Annotated[str, Field(max_length=60)] = ""
    """Name for people; empty: kind and number."""
    x_m: Coordinate
    """Place of its frame's origin, map frame: east."""
    y_m: Coordinate
    """The same: north."""
    heading_rad: Angle = 0.0
    """Direction of its frame's x axis, in the map frame."""
    radius_m: Annotated[float, Field(ge=0.01, le=20)] | None = None
    """Radius, if it is a disc."""
    outline: Annotated[tuple[Corner, ...] | None, Field(min_length=3, max_length=100), AfterValidator(_simple)] = None
    """Corners in its own frame, convex or not, if it is no disc."""
    height_m: Annotated[float, Field(gt=0, le=100)] | None = None
    """Height above the ground; a lidar whose plane is higher does not see it."""
    mass_kg: Annotated[float, Field(ge=0, le=10_000)] | None = None
    """Mass of a disc that can be pushed; 0: fixed to the ground."""
    surface: Surface | None = None
    """Reflectivity, for the range of lidars."""
    soft: bool | None = None
    """True: it presses no bumper; if it is fixed, too, the robot drives through it, as through tall grass."""
    motion: Motion = Still()

    @model_validator(mode="after")
    def _shape_is_one(self) -> Self:
        if self.radius_m is not None and self.outline is not None:
            raise misfit("outline", len(self.outline), "give an outline or radius_m, not both")
        if self.outline_m and self.mass_kg:
            raise misfit("mass_kg", self.mass_kg, "give radius_m, too: only a disc can be pushed")
        if self.motion.kind != "still" and not self.movable_kg:
            what = "radius_m and mass_kg" if self.outline_m else "mass_kg"
            raise misfit("motion", self.motion.kind, f"give {what}, too: only a disc with a mass moves")
        return self

    @property
    def figures(self) -> KindDefaults:
        """Figures of its kind."""
        return KIND_DEFAULTS[self.kind]

    @property
    def disc_m(self) -> float:
        """Radius [m]; 0 if it has an outline."""
        if self.radius_m is not None:
            return self.radius_m
        return 0.0 if self.outline is not None else self.figures.radius_m

    @property
    def outline_m(self) -> tuple[Corner, ...]:
        """Corners in its own frame; none if it is a disc."""
        return () if self.disc_m else self.outline or self.figures.outline

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Corners in the map frame [m]; none if it is a disc."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return tuple((self.x_m + cos * x - sin * y, self.y_m + sin * x + cos * y) for x, y in self.outline_m)

    @property
    def movable_kg(self) -> float:
        """Mass, if it can be pushed or moves; else 0."""
        if self.outline_m:
            return 0.0
        return self.figures.mass_kg if self.mass_kg is None else self.mass_kg

    @property
    def tall_m(self) -> float:
        """Height above the ground."""
        return self.figures.height_m if self.height_m is None else self.height_m

    @property
    def dark(self) -> bool:
        """True if its surface is dark."""
        return (self.surface or self.figures.surface) == "dark"

    @property
    def yields(self) -> bool:
        """True if it presses no bumper."""
        return self.figures.soft if self.soft is None else self.soft
