"""Rigid motions of drawings into the map frame, and of the map frame's origin on the earth.

A template's own coordinates are those of its drawing, for a pitch about its centre. ``Placement`` carries them into
the map frame: first mirrored (north for south), then turned, then moved. The template's ``origin`` says where on the
earth the map frame's (0, 0) lies; a robot's map frame has an origin too (``Scenario.origin``, its base station).
Both must be the same place, or the drawing is carried over with :func:`to_map`.
"""

import math
from dataclasses import dataclass
from typing import Self

from touchline.schemas.scenario import Origin
from touchline.schemas.template import ArcSpec, Area, LineSpec, Placement, Polygon, Template, TemplateSegment

Point = tuple[float, float]

#: Two map origins closer than this (m) are the same.
SAME_ORIGIN_M = 0.001


@dataclass(frozen=True)
class Transform:
    """p → R p + t, where R is a rotation by (cos, sin), after a mirror at the x axis if ``mirror``."""

    cos: float
    sin: float
    x_m: float
    y_m: float
    mirror: bool = False

    @classmethod
    def of(cls, x_m: float, y_m: float, rotation_rad: float, mirror: bool = False) -> Self:
        """The motion by these amounts; quarter turns are exact, so that a turned field keeps its round figures."""
        quarter = rotation_rad / (math.pi / 2)
        if abs(quarter - round(quarter)) < 1e-12:
            cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
        else:
            cos, sin = math.cos(rotation_rad), math.sin(rotation_rad)
        return cls(cos, sin, x_m, y_m, mirror)

    @classmethod
    def half_turn(cls) -> Self:
        """By 180° about the origin."""
        return cls(-1.0, 0.0, 0.0, 0.0)

    def point(self, point: Point) -> Point:
        """Place to which ``point`` (m) is moved."""
        x, y = point[0], -point[1] if self.mirror else point[1]
        # + 0.0 turns −0.0 into 0.0
        return (self.cos * x - self.sin * y + self.x_m + 0.0, self.sin * x + self.cos * y + self.y_m + 0.0)

    def line(self, line: LineSpec) -> LineSpec:
        """The line where it goes."""
        return type(line)(start=self.point(line.start), end=self.point(line.end))

    def arc(self, arc: ArcSpec) -> ArcSpec:
        """The arc where it goes; a mirror turns its sweep round."""
        sweep = -arc.sweep_angle if self.mirror else arc.sweep_angle
        return type(arc)(start=self.point(arc.start), center=self.point(arc.center), sweep_angle=sweep)

    def segment(self, segment: TemplateSegment) -> TemplateSegment:
        """The segment where it goes, under its own id."""
        if segment.line is not None:
            return segment.model_copy(update={"line": self.line(segment.line)})
        assert segment.arc is not None
        return segment.model_copy(update={"arc": self.arc(segment.arc)})

    def area(self, area: Area) -> Area:
        """The area where it goes, under its own id; its swaths turn with it."""
        angle_deg = area.angle_deg
        if angle_deg is not None:
            turned_deg = math.degrees(math.atan2(self.sin, self.cos))
            angle_deg = math.remainder((-angle_deg if self.mirror else angle_deg) + turned_deg, 360.0)
        return Area(
            id=area.id,
            outline=tuple(map(self.point, area.outline)),
            holes=tuple(tuple(map(self.point, hole)) for hole in area.holes),
            angle_deg=angle_deg,
        )

    def polygon(self, polygon: Polygon) -> Polygon:
        """The outline where it goes, under its own name."""
        return Polygon(id=polygon.id, corners=tuple(map(self.point, polygon.corners)))

    def template(self, template: Template) -> Template:
        """All of it where it goes: what the body keeps inside of and off goes along with what is painted."""
        moved = {
            "segments": tuple(map(self.segment, template.segments)),
            "areas": tuple(map(self.area, template.areas)),
            "boundary": template.boundary and self.polygon(template.boundary),
            "obstacles": tuple(map(self.polygon, template.obstacles)),
        }
        return template.model_copy(update=moved)


def place(template: Template, placement: Placement) -> Template:
    """``template`` carried into the map frame; lengths and curvatures stay, a mirror turns arcs round.

    Its source, which speaks of the drawing's own origin, says so.
    """
    rotation_rad = math.radians(placement.rotation_deg)
    moved = Transform.of(placement.x_m, placement.y_m, rotation_rad, placement.mirror).template(template)
    return moved.model_copy(update={"source": f"{template.source} {placement}".strip()})


def to_map(template: Template, map_origin: Origin) -> Template:
    """``template`` in the map frame whose (0, 0) is ``map_origin``.

    East at the two origins differs by the convergence of the meridians, Δλ·sin φ; this rigid motion takes it along and
    keeps lines lines and arcs arcs. What it leaves out, the earth's curvature, is below 0.1 mm for origins 1 km apart
    and a field of 200 m. A template without an origin is taken to be in that map frame already.
    """
    if template.origin is None:
        return template
    x, y = offset_m(template.origin, map_origin)
    mean_rad = math.radians((template.origin.latitude_deg + map_origin.latitude_deg) / 2)
    turn_rad = math.radians(_wrap_deg(template.origin.longitude_deg - map_origin.longitude_deg)) * math.sin(mean_rad)
    moved = Transform.of(x, y, turn_rad).template(template)
    return moved.model_copy(update={"origin": map_origin})


def offset_m(origin: Origin, map_origin: Origin) -> Point:
    """(east, north) in m of ``origin`` seen from ``map_origin``, in the tangent plane at ``map_origin``."""
    from pymap3d import geodetic2enu  # here: it loads NumPy, without which the command line starts sooner

    there, here = ((o.latitude_deg, o.longitude_deg, o.altitude_m) for o in (origin, map_origin))
    east, north, _ = geodetic2enu(*there, *here)
    return float(east), float(north)


def same_place(first: Origin, second: Origin) -> bool:
    """Return whether two origins are within a millimetre on the ground."""
    return math.hypot(*offset_m(first, second)) <= SAME_ORIGIN_M


def _wrap_deg(angle_deg: float) -> float:
    return (angle_deg + 180.0) % 360.0 - 180.0
