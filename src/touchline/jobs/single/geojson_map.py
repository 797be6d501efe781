"""Template, plan and paint in a recording, as GeoJSON (RFC 7946) in WGS 84."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from touchline.core.geodesy import local_frame, to_geodetic
from touchline.jobs.single.recorded_paint import RecordedPaint, read_all_painted
from touchline.recordings.channels import namespace_at, topic_at
from touchline.recordings.decoding import as_message
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.curves import Curve, spin_rad
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import String, Trajectory
from touchline.schemas.placement import to_map
from touchline.schemas.scenario import Origin
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.template import Position

#: Largest distance of chords from arcs, m.
_SAGITTA_M = 0.001
#: Decimals of degrees: 0.1 mm on the ground.
_DECIMALS = 9

Json = dict[str, Any]


def geojson_map(path: Path, robot: str | None = None) -> Json:
    """Return a FeatureCollection of the last traversal in a recording, or of all of several robots.

    The property ``is`` of a feature gives its kind, ``robot`` its robot if there are several.

    Args:
        path: The recording.
        robot: Namespace of the robot; None: all.

    Raises:
        RecordingError: The recording cannot be read.
        SpecError: It has no template, or no geodetic origin.
        PayloadError: A message in it does not fit its topic.
    """
    recorded, driven = read_all_painted(path, robot), _read_driven(path)
    several = len(recorded) > 1
    features = list[Json]()
    for name, painted in recorded.items():
        own = driven.get(name, _Driven())
        found = _features(painted if several else painted[-1:], own.plans if several else own.plans[-1:], own, path)
        for feature in found:
            feature["properties"] |= {"robot": name} if several else {}
        features += found
    return {"type": "FeatureCollection", "features": features}


@dataclass
class _Driven:
    """Plans of a robot, and the geodetic origin of its map frame."""

    plans: list[Trajectory] = field(default_factory=list)
    origin: Origin | None = None


def _features(painted: Sequence[RecordedPaint], plans: Sequence[Trajectory], driven: _Driven, path: Path) -> list[Json]:
    """Return features of one robot's traversals; the first has its template, later ones may be others' work."""
    first = painted[0].template
    origin = driven.origin or first.origin
    if origin is None:
        remedy = "give one with a setup, or of a template with an origin"
        raise SpecError(str(path), "setup", "is not recorded, so its place on the earth is unknown", remedy)
    earth, template = _Earth(origin), to_map(first, origin)
    features = [earth.line(s.curve(), is_="template", id=s.id, label=s.label) for s in template.segments]
    features += [earth.area((area.outline, *area.holes), is_="area", id=area.id) for area in template.areas]
    if template.boundary is not None:
        features.append(earth.area((template.boundary.corners,), is_="boundary", id=template.boundary.id))
    features += [earth.area((each.corners,), is_="obstacle", id=each.id) for each in template.obstacles]
    features += [feature for plan in plans for feature in earth.plan(plan)]
    features += [
        earth.points(stroke.x_m, stroke.y_m, is_="paint", id=stroke.segment_id, width_m=stroke.width_m)
        for each in painted
        for stroke in each.strokes
        if len(stroke.x_m) > 1
    ]
    return features


def _read_driven(path: Path) -> dict[str, _Driven]:
    """Return plans and origin of each robot, by namespace."""
    found: dict[str, _Driven] = {}
    for message in RecordingReader(path).messages():
        topic, namespace = topic_at(message.topic), namespace_at(message.topic)
        if topic is topics.PLAN:
            found.setdefault(namespace, _Driven()).plans.append(as_message(Trajectory, message))
        elif topic is topics.SETUP:
            text = decode(String, message.payload).data
            setup = parse(Setup, text, f"the setup in {path.name}", recorded=True)
            found.setdefault(namespace, _Driven()).origin = setup.scenario.origin
    return found


class _Earth:
    """Converter of the map frame with origin ``origin`` to features."""

    def __init__(self, origin: Origin) -> None:
        self._frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)

    def line(self, curve: Curve, **properties: object) -> Json:
        """Return a LineString along a curve."""
        bend = abs(curve.curvature_1pm)
        step_m = math.sqrt(8.0 * _SAGITTA_M / bend) if bend else curve.length_m
        count = max(math.ceil(curve.length_m / step_m), 1)
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count + 1))
        return self.points(x, y, **properties)

    def points(self, x_m: ArrayLike, y_m: ArrayLike, **properties: object) -> Json:
        """Return a LineString through at least two points."""
        return _feature("LineString", self._positions(x_m, y_m), properties)

    def area(self, rings: Sequence[Sequence[Position]], **properties: object) -> Json:
        """Return a Polygon, the outer ring counter-clockwise and the holes clockwise, all closed."""
        found = []
        for number, corners in enumerate(rings):
            x, y = np.array(corners, dtype=np.float64).T
            turns_left = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) > 0.0
            positions = self._positions(x, y)
            if turns_left != (number == 0):
                positions.reverse()
            found.append([*positions, positions[0]])
        return _feature("Polygon", found, properties)

    def plan(self, plan: Trajectory) -> Iterator[Json]:
        """Yield LineStrings of the plan's segments in their order; turns on the spot have no length."""
        for number, segment in enumerate(plan.path.segments):
            if spin_rad(segment.curve) is None:
                direction = "backward" if segment.direction.value < 0 else "forward"
                curve = Curve.from_message(segment.curve)
                yield self.line(curve, is_="plan", id=segment.id, number=number, direction=direction)

    def _positions(self, x_m: ArrayLike, y_m: ArrayLike) -> list[list[float]]:
        """Return [longitude, latitude] of points of the map frame."""
        places = []
        for x, y in zip(np.asarray(x_m, dtype=np.float64), np.asarray(y_m, dtype=np.float64), strict=True):
            latitude, longitude, _ = to_geodetic(self._frame, x, y, 0.0)
            places.append([round(float(longitude), _DECIMALS), round(float(latitude), _DECIMALS)])
        return places


def _feature(kind: str, coordinates: list[Any], properties: dict[str, object]) -> Json:
    given = {name.rstrip("_"): value for name, value in properties.items()}
    return {"type": "Feature", "properties": given, "geometry": {"type": kind, "coordinates": coordinates}}
