"""Markers of templates and robots' bodies: each message has all of them, so that late joiners see them all."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from touchline.schemas.cdr import encode
from touchline.schemas.curves import Curve
from touchline.schemas.frames import MAP_FRAME
from touchline.schemas.messages import (
    ColorRGBA,
    Duration,
    Header,
    Marker,
    MarkerArray,
    Point,
    Pose,
    Vector3,
)
from touchline.schemas.template import Position, Template
from touchline.schemas.vehicles import Vehicle

if TYPE_CHECKING:
    import shapely  # needed only for what is filled or simplified

Floats = npt.NDArray[np.float64]

#: Largest distance of chords from arcs.
SAGITTA_M: Final = 0.005
_OUTLINE_M: Final = 0.05
#: Heights of layers: fills, template, work, body.
_FILL_Z_M, _TEMPLATE_Z_M, WORK_Z_M, _BODY_Z_M = -0.02, 0.0, 0.01, 0.05

_FOREVER: Final = Duration()
_LINE: Final = ColorRGBA(r=0.75, g=0.78, b=0.82, a=0.6)
_AREA: Final = ColorRGBA(r=0.45, g=0.65, b=0.95, a=0.25)
_BOUNDARY: Final = ColorRGBA(r=1.0, g=0.75, b=0.1, a=0.9)
_OBSTACLE: Final = ColorRGBA(r=0.9, g=0.2, b=0.2, a=0.8)
_BODY: Final = ColorRGBA(r=0.1, g=0.55, b=0.95, a=0.7)
_TRUE_BODY: Final = ColorRGBA(r=0.2, g=0.85, b=0.35, a=0.5)
_WHEEL: Final = ColorRGBA(r=0.12, g=0.12, b=0.14, a=1.0)
_TOOL: Final = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)


def chords(curve: Curve, sagitta_m: float = SAGITTA_M) -> tuple[Floats, Floats]:
    """Return points along a curve, its ends included, whose chords leave it by no more than ``sagitta_m``."""
    bend = abs(curve.curvature_1pm)
    step_m = math.sqrt(8.0 * sagitta_m / bend) if bend else curve.length_m
    count = max(math.ceil(curve.length_m / step_m), 1)
    x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count + 1))
    return x, y


def template_markers(template: Template) -> MarkerArray:
    """Return a template's markers in the map frame: lines by width, areas, boundary and obstacles, with their ids."""
    drawn = [Marker(action=Marker.DELETEALL)]
    for number, segment in enumerate(template.segments):
        x, y = chords(segment.curve())
        points = _points(np.column_stack((x, y)), _TEMPLATE_Z_M)
        drawn.append(_strip("lines", number, points, template.line_width_m, _LINE, segment.id))
    for number, area in enumerate(template.areas):
        drawn.append(_fill("areas", number, area.polygon, _AREA, area.id))
    edged = [("obstacles", _OBSTACLE, each) for each in template.obstacles]
    if template.boundary is not None:
        edged.append(("boundary", _BOUNDARY, template.boundary))
    for number, (kind, color, polygon) in enumerate(edged):
        drawn.append(_strip(kind, number, _ring(polygon.corners, _TEMPLATE_Z_M), _OUTLINE_M, color, polygon.id))
    header = Header(frame_id=MAP_FRAME)
    return MarkerArray(markers=tuple(each.model_copy(update={"header": header}) for each in drawn))


def body_markers(vehicle: Vehicle, frame: str, *, true: bool = False) -> MarkerArray:
    """Return a robot's outline, wheels and tool, fixed to its frame; of the ``true`` body only the outline."""
    outline = vehicle.body.footprint_m
    color = _TRUE_BODY if true else _BODY
    drawn = [_strip("body", 0, _ring(outline, _BODY_Z_M), _OUTLINE_M, color, vehicle.name)]
    if not true:
        import shapely

        drawn += [_fill("body", 1, shapely.Polygon(outline), color, vehicle.name), *_wheels(vehicle), _tool(vehicle)]
    header = Header(frame_id=frame)
    return MarkerArray(
        markers=tuple(each.model_copy(update={"header": header, "frame_locked": True}) for each in drawn)
    )


def _wheels(vehicle: Vehicle) -> Iterator[Marker]:
    for number, wheel in enumerate(vehicle.drive.contacts):
        middle = Pose(position=Point(x=wheel.x_m, y=wheel.y_m, z=wheel.radius_m))
        size = Vector3(x=2 * wheel.radius_m, y=wheel.width_m, z=2 * wheel.radius_m)
        yield Marker(ns="wheels", id=number, type=Marker.CUBE, pose=middle, scale=size, color=_WHEEL)


def _tool(vehicle: Vehicle) -> Marker:
    x, y = vehicle.tool.point_m
    size = Vector3(x=0.06, y=max(vehicle.tool.width_m, 0.06), z=0.06)
    return Marker(ns="tool", type=Marker.CUBE, pose=Pose(position=Point(x=x, y=y)), scale=size, color=_TOOL)


def _points(places: npt.ArrayLike, z_m: float) -> tuple[Point, ...]:
    return tuple(Point(x=x, y=y, z=z_m) for x, y in np.asarray(places, dtype=np.float64).tolist())


def _ring(corners: Sequence[Position], z_m: float) -> tuple[Point, ...]:
    return _points((*corners, corners[0]), z_m)


def _strip(ns: str, number: int, points: tuple[Point, ...], width_m: float, color: ColorRGBA, text: str) -> Marker:
    width = Vector3(x=width_m, y=1.0, z=1.0)
    return Marker(ns=ns, id=number, type=Marker.LINE_STRIP, scale=width, color=color, points=points, text=text)


def _fill(ns: str, number: int, polygon: shapely.Polygon, color: ColorRGBA, text: str) -> Marker:
    """Return a polygon with its holes as triangles."""
    import shapely

    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    points, one = _points(corners, _FILL_Z_M), Vector3(x=1.0, y=1.0, z=1.0)
    return Marker(ns=ns, id=number, type=Marker.TRIANGLE_LIST, scale=one, color=color, points=points, text=text)


class LineList:
    """Fast packer of a marker of many lines in the map frame.

    In CDR a marker with n points is one with a single point whose count is n and whose point is repeated.
    """

    def __init__(self, ns: str, width_m: float, color: ColorRGBA, lifetime: Duration = _FOREVER) -> None:
        width = Vector3(x=width_m, y=1.0, z=1.0)
        header = Header(frame_id=MAP_FRAME)
        marker = Marker(header=header, ns=ns, type=Marker.LINE_LIST, scale=width, color=color, lifetime=lifetime)
        self._none = encode(MarkerArray(markers=(marker.model_copy(update={"action": Marker.DELETE}),)))
        place = Point(x=1.25, y=-2.5, z=5.75)
        one, two = (
            encode(MarkerArray(markers=(marker.model_copy(update={"points": (place,) * count}),))) for count in (1, 2)
        )
        self._count_at = next(at for at, pair in enumerate(zip(one, two, strict=False)) if pair[0] != pair[1])
        at = one.index(struct.pack("<3d", place.x, place.y, place.z))
        self._before, self._behind = one[:at], one[at + 24 :]

    def pack(self, lines: Floats, colors: Floats | None = None) -> bytes:
        """Return a MarkerArray of lines; without lines one that removes the marker.

        Args:
            lines: Lines (n, 4) from x, y to x, y (m).
            colors: Red, green, blue and opacity (n, 4) of each, 0…1; None: all have the marker's.
        """
        if not len(lines):
            return self._none
        points = np.full((2 * len(lines), 3), WORK_Z_M)
        points[:, :2] = lines.reshape(-1, 2)
        payload = bytearray(self._before)
        struct.pack_into("<I", payload, self._count_at, len(points))
        behind = self._behind
        if colors is not None:  # one for each point; the template has none
            each = np.repeat(colors, 2, axis=0).astype("<f4")
            behind = struct.pack("<I", len(each)) + each.tobytes() + behind[4:]
        return bytes(payload) + points.tobytes() + behind


def lines_through(points: Floats) -> Floats:
    """Return lines (n − 1, 4) through points (n, 2), one after another."""
    return np.hstack((points[:-1], points[1:]))


def simplified(points: Floats, tolerance_m: float) -> Floats:
    """Return those of points (n, 2) whose line is within the tolerance of the others (Douglas and Peucker 1973)."""
    if len(points) < 3:
        return points
    import shapely

    return shapely.get_coordinates(shapely.simplify(shapely.LineString(points), tolerance_m, preserve_topology=False))


def headings(points: Floats) -> Iterator[float]:
    """Yield the direction (rad) from each point to the next; the last one repeats."""
    heading = 0.0
    for (x, y), (next_x, next_y) in pairwise(points.tolist()):
        heading = math.atan2(next_y - y, next_x - x)
        yield heading
    yield heading
