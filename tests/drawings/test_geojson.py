"""GeoJSON files as templates, ours and those of others."""

import json
import math
from pathlib import Path

import pytest

from touchline.drawings.geojson import read_geojson
from touchline.schemas.errors import SpecError
from touchline.schemas.scenario import Origin

SPRING = {"type": "LineString", "coordinates": [[9.99, 57.01], [9.9902, 57.01], [9.9902, 57.0101]]}
FIELD = {
    "type": "Polygon",
    "coordinates": [[[9.99, 57.01], [9.9905, 57.01], [9.9905, 57.0103], [9.99, 57.0103], [9.99, 57.01]]],
}


def written(tmp_path: Path, content: object) -> Path:
    path = tmp_path / "ground.geojson"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def feature(geometry: object, **properties: object) -> dict[str, object]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def test_lines_areas_boundary_and_obstacles_are_told_apart(tmp_path: Path) -> None:
    content = {
        "type": "FeatureCollection",
        "features": [
            feature(SPRING, name="edge"),
            feature(FIELD, name="lawn"),
            feature(FIELD, **{"is": "boundary"}),
            feature(
                {"type": "MultiPolygon", "coordinates": [FIELD["coordinates"]]}, **{"is": "obstacle", "id": "shed"}
            ),
            feature({"type": "Point", "coordinates": [9.99, 57.01]}),
            feature(None),
        ],
    }
    template = read_geojson(written(tmp_path, content))
    assert [segment.label for segment in template.segments] == ["edge", "edge"]
    assert [area.id for area in template.areas] == ["lawn"]
    assert template.boundary is not None and [each.id for each in template.obstacles] == ["shed"]
    assert template.origin == Origin(latitude_deg=57.01015, longitude_deg=9.99025)
    # A degree of longitude at 57.01° north is 60.76 km long, one of latitude 111.37 km.
    assert template.areas[0].polygon.area == pytest.approx(0.0005 * 60_760 * 0.0003 * 111_370, rel=2e-3)
    assert template.length_m == pytest.approx(0.0002 * 60_760 + 0.0001 * 111_370, rel=2e-3)


def test_the_origin_can_be_given(tmp_path: Path) -> None:
    template = read_geojson(written(tmp_path, SPRING), Origin(latitude_deg=57.01, longitude_deg=9.99))
    assert template.segments[0].line is not None
    assert math.hypot(*template.segments[0].line.start) < 1e-6


def test_a_circle_of_short_lines_becomes_arcs(tmp_path: Path) -> None:
    ring = [
        [
            9.99 + 1e-4 * math.cos(k / 60 * math.tau) / math.cos(math.radians(57)),
            57.01 + 1e-4 * math.sin(k / 60 * math.tau),
        ]
        for k in range(61)
    ]
    template = read_geojson(written(tmp_path, {"type": "LineString", "coordinates": ring}))
    assert len(template.segments) < 10
    assert all(segment.arc is not None for segment in template.segments)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "is not JSON"),
        ([], "give a FeatureCollection"),
        ({"type": "FeatureCollection", "features": 3}, "features is not a list"),
        ({"type": "Point", "coordinates": [1, 2]}, "has no line and no polygon"),
        ({"type": "LineString", "coordinates": [[1, 2]]}, "give at least two"),
        ({"type": "LineString", "coordinates": [["a", 2], [1, 3]]}, "is not a list of positions"),
        ({"type": "LineString", "coordinates": [[57e4, 6e6], [57e4, 6.1e6]]}, "is not in degrees"),
        ({"type": "LineString", "coordinates": [[math.nan, 1], [2, 1]]}, "is not in degrees"),
        ({"type": "LineString", "coordinates": [[0, 0], [90, 0]]}, "from the origin"),
        ({**SPRING, "crs": {"type": "name", "properties": {"name": "EPSG:25832"}}}, "crs is 'EPSG:25832'"),
        (
            feature({"type": "Polygon", "coordinates": [[[0, 0], [0, 1e-3], [1e-3, 0], [1e-3, 1e-3], [0, 0]]]}),
            "must not cross",
        ),
        (feature({"type": "Circle"}), "is 'Circle'"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_place(tmp_path: Path, content: object, words: str) -> None:
    with pytest.raises(SpecError, match=words):
        read_geojson(written(tmp_path, content))
