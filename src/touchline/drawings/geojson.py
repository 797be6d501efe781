"""GeoJSON (RFC 7946) as a template: lines to mark, areas to work, boundary and obstacles, in degrees of WGS 84.

A feature's property `is` tells which it is, as in the maps that Touchline writes: "boundary" and "obstacle"; without it
a polygon is an area and a line a line. Lines of many short pieces are fitted with arcs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from touchline.core.geodesy import Floats, local_frame, to_local
from touchline.drawings.detail import Detail
from touchline.drawings.importer import stroke_segment, with_unique_ids
from touchline.drawings.outline import Outline, Smooth
from touchline.drawings.strokes import Strokes
from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError
from touchline.schemas.plain_text import plain
from touchline.schemas.scenario import Origin
from touchline.schemas.spec import problems_of, read_text
from touchline.schemas.template import MAX_COORDINATE_M, Template

LINE_WIDTH_M = 0.12
IGNORED = ("plan", "paint")
LINES, POLYGONS = ("LineString", "MultiLineString"), ("Polygon", "MultiPolygon")
LAWFUL_CRS = ("CRS84", "4326")
#: A line that turns by more at a point has a corner there; by less, it is straight. Between them it is taken for a
#: curve, if it has so many steps.
CORNER_RAD, STRAIGHT_RAD, BENT_STEPS = math.radians(25.0), math.radians(0.05), 4
#: Points nearer than this to the one before are left out.
SAME_M = 1e-4


class _Shape(NamedTuple):
    """Line, or rings of a polygon, in degrees: (n, 2) longitude and latitude."""

    name: str
    use: str
    rings: list[Floats]
    encloses: bool


def read_geojson(path: Path, origin: Origin | None = None) -> Template:
    """Read a template.

    Args:
        path: The file.
        origin: Origin of the map frame; None: the middle of what is drawn.

    Raises:
        SpecError: The file is no GeoJSON in degrees, or makes no template.
    """
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise SpecError(path.name, "", f"is not JSON ({error})", "save it as GeoJSON") from error
    _check_system(path.name, content)
    shapes = [shape for shape in _shapes(path.name, content) if shape.use not in IGNORED]
    if not shapes:
        raise SpecError(path.name, "features", "has no line and no polygon", "draw some")
    every = np.concatenate([ring for shape in shapes for ring in shape.rings])
    if origin is None:
        longitude, latitude = (0.5 * (every.min(axis=0) + every.max(axis=0))).tolist()
        origin = Origin(latitude_deg=round(latitude, 7), longitude_deg=round(longitude, 7))
    frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
    return _template(path, origin, [_local(path.name, frame, shape) for shape in shapes])


def _check_system(source: str, content: Any) -> None:
    """Refuse coordinates that the file says are not in degrees."""
    named = content.get("crs") if isinstance(content, dict) else None
    name = str(named.get("properties", {}).get("name", "")) if isinstance(named, dict) else ""
    if name and not name.endswith(LAWFUL_CRS):
        raise SpecError(source, "crs", f"is {plain(name, 60)!r}", "save it in WGS 84 (EPSG:4326), as RFC 7946 asks")


def _shapes(
    source: str, content: Any, place: str = "", properties: Mapping[str, Any] | None = None
) -> Iterator[_Shape]:
    """Find lines and polygons, at any depth of collections."""
    kind = content.get("type") if isinstance(content, dict) else None
    if kind == "FeatureCollection":
        for number, feature in enumerate(_list(source, content, "features")):
            yield from _shapes(source, feature, f"features[{number}]")
    elif kind == "Feature":
        given = content.get("properties")
        named = dict(given) if isinstance(given, dict) else {}
        named.setdefault("id", content.get("id"))
        if content.get("geometry") is not None:
            yield from _shapes(source, content["geometry"], f"{place}.geometry".lstrip("."), named)
    elif kind == "GeometryCollection":
        for number, geometry in enumerate(_list(source, content, "geometries")):
            yield from _shapes(source, geometry, f"{place}.geometries[{number}]".lstrip("."), properties)
    elif kind in (*LINES, *POLYGONS):
        named = dict(properties or {})
        own = named.get("name") or named.get("id") or named.get("label")
        name, use = plain(str(own), 80) if own is not None else "", str(named.get("is", ""))
        parts = content.get("coordinates")
        for part in parts if kind.startswith("Multi") and isinstance(parts, list) else [parts]:
            rings = part if kind in POLYGONS else [part]
            read = [
                _positions(source, f"{place}.coordinates".lstrip("."), ring) for ring in _of_list(source, place, rings)
            ]
            yield _Shape(name or kind.removeprefix("Multi").lower(), use, read, kind in POLYGONS)
    elif kind not in ("Point", "MultiPoint"):
        raise SpecError(
            source, place or "type", f"is {plain(str(kind), 40)!r}", "give a FeatureCollection of lines or polygons"
        )


def _list(source: str, content: Mapping[str, Any], field: str) -> list[Any]:
    return _of_list(source, field, content.get(field))


def _of_list(source: str, field: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise SpecError(source, field, "is not a list", "give a list, as RFC 7946 has it")
    return value


def _positions(source: str, place: str, ring: Any) -> Floats:
    """Longitude and latitude (n, 2) of a line or ring, degrees."""
    try:
        found = np.array([position[:2] for position in ring], np.float64).reshape(-1, 2)
    except (TypeError, ValueError) as error:
        raise SpecError(source, place, "is not a list of positions", "give [longitude, latitude] pairs") from error
    if len(found) < 2:
        raise SpecError(source, place, f"has {len(found)} positions", "give at least two")
    if not (np.abs(found) <= (180.0, 90.0)).all():
        raise SpecError(source, place, "is not in degrees", "save it in WGS 84 (EPSG:4326), longitude first")
    return found


def _local(source: str, frame: Floats, shape: _Shape) -> _Shape:
    """Convert to metres of the map frame."""
    rings = []
    for ring in shape.rings:
        points = np.array([to_local(frame, latitude, longitude, 0.0)[:2] for longitude, latitude in ring.tolist()])
        if np.abs(points).max() > MAX_COORDINATE_M:
            away = f"reaches {np.abs(points).max() / 1e3:,.1f} km from the origin"
            raise SpecError(source, shape.name, away, f"keep within {MAX_COORDINATE_M / 1e3:g} km")
        moved = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > SAME_M))
        rings.append(points[moved])
    return shape._replace(rings=rings)


def _template(path: Path, origin: Origin, shapes: Sequence[_Shape]) -> Template:
    """Put a template together of shapes in metres."""
    segments, areas, boundary, obstacles = [], list[dict[str, Any]](), None, list[dict[str, Any]]()
    detail = Detail.of(LINE_WIDTH_M)
    for shape in shapes:
        if shape.encloses:
            outline, *holes = [_corners(ring) for ring in shape.rings]
            if shape.use == "boundary":
                boundary = {"corners": outline}
            elif shape.use == "obstacle":
                obstacles.append({"id": _free(shape.name, obstacles), "corners": outline})
            else:
                areas.append({"id": _free(shape.name, areas), "outline": outline, "holes": holes})
            continue
        points = shape.rings[0]
        closed = math.dist(points[0], points[-1]) <= SAME_M
        strokes = Strokes.of(Outline(shape.name, tuple(_pieces(points)), closed), detail)
        segments += [stroke_segment(shape.name, number, curve) for number, curve in enumerate(strokes.curves, 1)]
    given = {
        "name": plain(path.stem, 100) or "field",
        "title": plain(path.stem),
        "source": f"Imported from {plain(path.name)}.",
        "line_width_m": LINE_WIDTH_M,
        "origin": origin,
        "segments": [segment.model_dump() for segment in with_unique_ids(segments)],
        "areas": areas,
        "boundary": boundary,
        "obstacles": obstacles,
    }
    try:
        return Template.model_validate(given)
    except ValidationError as error:
        raise problems_of(error, path.name, given, Template) from error


def _pieces(points: Floats) -> Iterator[Curve | Smooth]:
    """Pieces of a line: straight between corners, and smooth where it bends in short steps.

    Args:
        points: (n, 2) positions (m).
    """
    steps = np.diff(points, axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs(np.remainder(np.diff(headings) + np.pi, 2.0 * np.pi) - np.pi)
    corners = [0, *(np.flatnonzero((turns > CORNER_RAD) | (turns < STRAIGHT_RAD)) + 1).tolist(), len(points) - 1]
    for first, last in pairwise(dict.fromkeys(corners)):
        if last - first >= BENT_STEPS:
            yield _smooth(points[first : last + 1])
        else:
            run = points[first : last + 1].tolist()
            yield from (Curve.from_line(tuple(a), tuple(b)) for a, b in pairwise(run))


def _smooth(points: Floats) -> Smooth:
    """Curve through points (n, 2)."""
    from scipy.interpolate import CubicSpline

    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    spline = CubicSpline(along, points)
    return Smooth(spline, spline.derivative(), (0.0, float(along[-1])))


def _corners(ring: Floats) -> list[list[float]]:
    """Corners of a ring without its last position, which repeats the first."""
    closed = np.hypot(*(ring[0] - ring[-1])) <= SAME_M
    corners: list[list[float]] = (ring[:-1] if closed else ring).tolist()
    return corners


def _free(name: str, others: Sequence[Mapping[str, Any]]) -> str:
    """The name, with a number behind it if another one has it."""
    taken, found, count = {other["id"] for other in others}, name, 1
    while found in taken:
        count += 1
        found = f"{name}-{count}"
    return found
