"""Templates: what is to be painted, and nothing else."""

from __future__ import annotations

import json
import math
from functools import cached_property
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from touchline.schemas.curves import Curve
from touchline.schemas.given_angles import Angle
from touchline.schemas.plain_text import printable
from touchline.schemas.scenario import Origin
from touchline.schemas.spec import GrownSpec, Spec
from touchline.schemas.swath_ids import area_id_of, line_id_of, swath_id

if TYPE_CHECKING:
    import shapely

#: A radio-corrected robot works within about a kilometre of its base; beyond this a coordinate is a mistake.
MAX_COORDINATE_M = 10_000.0
#: Shorter lines cannot be told from a point by the robot.
MIN_LENGTH_M = 0.01
#: An outline with less inside is a mistake.
MIN_AREA_M2 = 1e-4

#: How far the middle of the paint may be off its line where the template does not say.
DEFAULT_TOLERANCE_M = 0.03

#: More than any label needs, and little enough for a hundred thousand of them.
MAX_TEXT = 10_000


def _shown(text: str, info: ValidationInfo) -> str:
    """Text that is shown to people; a recording's is read as it is, and made plain where it is shown."""
    recorded = isinstance(info.context, dict) and info.context.get("recorded", False)
    return text if recorded else printable(text)


Name = Annotated[str, Field(min_length=1, max_length=100), AfterValidator(_shown)]
Text = Annotated[str, Field(max_length=MAX_TEXT), AfterValidator(_shown)]
Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Position = tuple[Coordinate, Coordinate]


class LineSpec(Spec):
    """A straight line from ``start`` to ``end``, metres in the map frame."""

    start: Position
    """Start, m."""
    end: Position
    """End, m, at least 1 cm away."""

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if math.dist(self.start, self.end) < MIN_LENGTH_M:
            raise ValueError(f"the line's start and end must be at least {MIN_LENGTH_M} m apart")
        return self


class ArcSpec(Spec):
    """A circular arc about ``center`` from ``start``; ``sweep_angle`` in radians, counter-clockwise positive."""

    start: Position
    """Start, m."""
    center: Position
    """Center, m."""
    sweep_angle: Angle
    """Angle from start to end, rad, counter-clockwise positive."""

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        radius = math.dist(self.start, self.center)
        if radius < MIN_LENGTH_M:
            raise ValueError(f"the arc's start must be at least {MIN_LENGTH_M} m from its center")
        if radius * abs(self.sweep_angle) < MIN_LENGTH_M:
            raise ValueError(f"the arc must be at least {MIN_LENGTH_M} m long: enlarge sweep_angle")
        return self


class TemplateSegment(Spec):
    """One line or arc to be painted."""

    id: Name
    """Unique name."""
    label: Text = ""
    """Text for people."""
    line: LineSpec | None = None
    """`start` and `end`; a segment has either a line or an arc."""
    arc: ArcSpec | None = None
    """`start`, `center` and `sweep_angle`."""
    actuation: Literal["SPRAY", "DISC_SPRAY"] = "DISC_SPRAY"
    """`SPRAY` leaves the discs up."""

    @model_validator(mode="after")
    def _one_curve(self) -> Self:
        if (self.line is None) == (self.arc is None):
            raise ValueError("give exactly one of line and arc")
        return self

    def curve(self) -> Curve:
        """The curve that the nozzle shall follow."""
        if self.line is not None:
            return Curve.from_line(self.line.start, self.line.end)
        assert self.arc is not None  # the validator saw to it
        return Curve.from_arc(self.arc.start, self.arc.center, self.arc.sweep_angle)


class Placement(Spec):
    """A rigid motion of the drawing: mirrored about its x axis, then turned about its origin, then moved."""

    x_m: Annotated[float, Field(ge=-10_000, le=10_000)] = 0.0
    """Shift to the east."""
    y_m: Annotated[float, Field(ge=-10_000, le=10_000)] = 0.0
    """Shift to the north."""
    rotation_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    """Turn about the drawing's origin, counter-clockwise."""
    mirror: bool = False
    """Mirror the drawing about its x axis first."""

    def __str__(self) -> str:
        """In words."""
        turned = f", turned by {self.rotation_deg:g} degrees" if self.rotation_deg else ""
        mirrored = "mirrored, " if self.mirror else ""
        return f"Placed: {mirrored}its origin at x {self.x_m:g}, y {self.y_m:g} m{turned}."


def _simple(corners: tuple[Position, ...]) -> tuple[Position, ...]:
    if not find_spec("shapely"):  # what plans has it, and so never sees an outline that was not checked
        return corners
    import shapely  # only templates with polygons pay for it

    outline = shapely.Polygon(corners)
    if not outline.is_valid or outline.area < MIN_AREA_M2:
        raise ValueError("an outline must have an area and must not cross or touch itself")
    return corners


Corners = Annotated[tuple[Position, ...], Field(min_length=3, max_length=1000), AfterValidator(_simple)]
"""A closed outline, corner by corner (either way round; the last corner joins the first), metres."""


def _enclosed_m2(corners: tuple[Position, ...]) -> float:
    (x0, y0), *others = corners
    moved = [(x - x0, y - y0) for x, y in others]
    return abs(math.fsum(xa * yb - xb * ya for (xa, ya), (xb, yb) in pairwise(moved))) / 2.0


class Polygon(Spec):
    """An outline with a name."""

    id: Name = "boundary"
    """Name."""
    corners: Corners
    """Corners, m, either way round; the last joins the first."""


class Area(Spec):
    """Area that is painted solid: the inside of an outline, less its holes.

    It is planned as swaths, lines that lie side by side at the width of the tool, each a segment of its own.
    """

    id: Annotated[Name, Field(max_length=80)]
    """Unique name; its swaths are the segments `ID#1`, `ID#2`, …"""
    outline: Corners
    """3 to 1,000 corners, either way round; it crosses and touches itself nowhere."""
    holes: Annotated[tuple[Corners, ...], Field(max_length=100)] = ()
    """Outlines that are left out: inside, not touching the outline or each other."""
    angle_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    """Direction of the swaths, counter-clockwise from +x; null: the best."""

    @field_validator("holes")
    @classmethod
    def _inside_and_apart(cls, holes: tuple[Corners, ...], info: ValidationInfo) -> tuple[Corners, ...]:
        if not find_spec("shapely"):
            return holes
        import shapely

        outline = shapely.Polygon(info.data["outline"]) if "outline" in info.data else None
        found = [shapely.Polygon(hole) for hole in holes]
        for i, hole in enumerate(found):
            if outline and not outline.contains_properly(hole):
                raise ValueError(f"holes[{i}] must lie inside the outline, not touching it")
            if any(hole.intersects(other) for other in found[:i]):
                raise ValueError(f"holes[{i}] must keep apart from the other holes")
        return holes

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """As a polygon, m."""
        import shapely

        return shapely.Polygon(self.outline, self.holes)

    def edges(self) -> list[Curve]:
        """The lines round it and round its holes."""
        rings = (self.outline, *self.holes)
        return [Curve.from_line(a, b) for ring in rings for a, b in pairwise((*ring, ring[0])) if a != b]

    def swath_id(self, number: int) -> str:
        """The segment id of one of its swaths, counted from 1."""
        return swath_id(self.id, number)


class Template(GrownSpec):
    """A drawing of lines, arcs and areas in the map frame (metres, x east, y north).

    The robot's body stays inside ``boundary`` and off every one of ``obstacles`` (goal posts, benches, trees).
    """

    name: Name
    """Name for people and file names."""
    title: Text = ""
    """A line for people."""
    source: Text = ""
    """Source of the measures."""
    line_width_m: Annotated[float, Field(ge=0.02, le=0.3)] = 0.12
    """Width of lines and arcs; paint counts within it."""
    tolerance_m: Annotated[float, Field(ge=0.001, le=0.3)] = DEFAULT_TOLERANCE_M
    """Largest distance of the paint's middle from its line that is accepted."""
    placement: Placement | None = None
    """Position of the drawing in the map frame; null: at the origin.

    None once `touchline.schemas.catalogue` has carried it out.
    """
    origin: Origin | None = None
    """Position of (0, 0) on the earth; null: the robot's origin."""
    segments: tuple[TemplateSegment, ...] = ()
    """Lines and arcs; a template has at least one of these or one area."""
    areas: Annotated[tuple[Area, ...], Field(max_length=100)] = ()
    """Areas that are painted solid or covered."""
    boundary: Polygon | None = None
    """`corners` of where the robot's body must stay."""
    obstacles: Annotated[tuple[Polygon, ...], Field(max_length=1000)] = ()
    """`id` and `corners` of what the body keeps off."""

    @field_validator("segments")
    @classmethod
    def _unique_ids(cls, segments: tuple[TemplateSegment, ...]) -> tuple[TemplateSegment, ...]:
        seen: dict[str, int] = {}
        for index, segment in enumerate(segments):
            if segment.id in seen:
                raise ValueError(
                    f'segments[{seen[segment.id]}] and segments[{index}] share the id "{segment.id}": give each its own'
                )
            seen[segment.id] = index
        return segments

    @field_validator("areas")
    @classmethod
    def _unique_names(cls, areas: tuple[Area, ...]) -> tuple[Area, ...]:
        names = [area.id for area in areas]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(f'areas[{names.index(name)}] and areas[{i}] share the id "{name}": give each its own')
        return areas

    @model_validator(mode="after")
    def _something_to_paint(self) -> Self:
        if not (self.segments or self.areas):
            raise ValueError("give at least one of segments and areas")
        for i, segment in enumerate(self.segments):
            if self.areas and self.area_of(segment.id):
                raise ValueError(f'segments[{i}] has the id "{segment.id}" of a swath of an area: give it another')
        return self

    later_fields = ("areas",)

    @property
    def length_m(self) -> float:
        """Metres of lines to be painted; areas do not count."""
        return math.fsum(segment.curve().length_m for segment in self.segments)

    @property
    def area_m2(self) -> float:
        """Square metres to be painted solid."""
        return math.fsum(_enclosed_m2(a.outline) - math.fsum(map(_enclosed_m2, a.holes)) for a in self.areas)

    def area_of(self, segment_id: str) -> Area | None:
        """The area of which a segment of that id is a swath; None if it is of none."""
        name = area_id_of(segment_id)
        return next((area for area in self.areas if area.id == name), None) if name else None

    def paints(self, segment_id: str) -> bool:
        """Return whether a segment is painted: one of the template's own, a part of one, or a swath of an area."""
        ids = segment_id, line_id_of(segment_id)
        return any(each in self._own_ids or self.area_of(each) is not None for each in ids)

    @cached_property
    def _own_ids(self) -> frozenset[str]:
        return frozenset(segment.id for segment in self.segments)

    def to_json(self) -> str:
        """This template as a file's text, one segment a line; reading it gives the same template again."""
        head = self.model_dump(mode="json", exclude={"segments"}, exclude_none=True)
        lines = [f"  {json.dumps(name)}: {json.dumps(value, ensure_ascii=False)},\n" for name, value in head.items()]
        segments = ",\n".join(f"    {s.model_dump_json(exclude_none=True)}" for s in self.segments)
        return "{\n" + "".join(lines) + f'  "segments": [\n{segments}\n  ]\n}}\n'
