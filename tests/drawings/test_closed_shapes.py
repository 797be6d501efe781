"""Closed shapes of SVG and DXF files as areas: what is a hole, what is joined, what is mended and what is refused."""

import itertools
import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

from touchline.drawings.fill_rule import enclosed
from touchline.drawings.importer import Anchor, Imported, ImportOptions, import_drawing
from touchline.drawings.outline import FillRule
from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import SpecError
from touchline.schemas.template import Template


def svg(tmp_path: Path, body: str, **options: Any) -> Imported:
    path = tmp_path / "field.svg"
    space = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {space}>{body}</svg>')
    return import_drawing(path, ImportOptions(1.0, anchor=Anchor.OWN, areas=True, **options))


def dxf(tmp_path: Path, draw: Any, **options: Any) -> Imported:
    drawing = ezdxf.new(units=6)
    draw(drawing.modelspace())
    path = tmp_path / "field.dxf"
    drawing.saveas(path)
    return import_drawing(path, ImportOptions(anchor=Anchor.OWN, areas=True, **options))


def shape(template: Template) -> list[tuple[float, int]]:
    """Square metres and number of holes of each area; all of it reads back as it was written."""
    assert parse_template(template.to_json()) == template
    return [(round(area.polygon.area, 2), len(area.holes)) for area in template.areas]


BOX = "M0 0H20V10H0Z"
INNER, REVERSED = "M5 2H15V8H5Z", "M5 2V8H15V2Z"


@pytest.mark.parametrize(
    ("body", "found"),
    [
        (f'<path d="{BOX}"/>', [(200.0, 0)]),
        ('<rect x="1" y="2" width="3" height="4" fill="none" stroke="red"/>', [(12.0, 0)]),
        (f'<path d="{BOX}{INNER}" fill-rule="evenodd"/>', [(140.0, 1)]),
        (f'<g style="fill-rule:evenodd"><path d="{BOX}{INNER}"/></g>', [(140.0, 1)]),
        (f'<path d="{BOX}{INNER}"/>', [(200.0, 0)]),  # nonzero, and both the same way round
        (f'<path d="{BOX}{REVERSED}"/>', [(140.0, 1)]),
        (f'<path d="{BOX}"/><path d="{INNER}" fill="white"/>', [(140.0, 1)]),
        (f'<path d="{BOX}"/><path d="{INNER}"/><rect x="7" y="4" width="2" height="2"/>', [(140.0, 1), (4.0, 0)]),
        (f'<path d="{BOX}" fill="red"/><path d="{BOX}" fill="none" stroke="black"/>', [(200.0, 0)]),
        (f'<path d="{BOX}"/><path d="M20 0H30V10H20Z"/>', [(200.0, 0), (100.0, 0)]),  # parcels side by side
        (f'<path d="{BOX}"/><path d="M15 5H30V10H15Z"/>', [(250.0, 0)]),  # overlap: one
        (f'<path d="{BOX}"/><path d="M0 2H5V8H0Z"/>', [(170.0, 0)]),  # along the edge: a bay
        (f'<path d="{BOX}"/><path d="M10 0L12 4H8Z"/>', [(192.0, 0)]),  # touches it in a point: a bay too
        ('<polyline points="0,0 10,0 10,10"/>', [(50.0, 0)]),  # open, but shown as filled
        ('<g transform="rotate(30) scale(2)"><path d="M0 0H2V3H0Z"/></g>', [(24.0, 0)]),
        (f'<defs><path id="a" d="{INNER}"/></defs><path d="{BOX}"/><a href="#a"/>', [(200.0, 0)]),
    ],
)
def test_svg(tmp_path: Path, body: str, found: list[tuple[float, int]]) -> None:
    imported = svg(tmp_path, body)
    assert shape(imported.template) == pytest.approx([pytest.approx(each, abs=0.02) for each in found])
    assert imported.template.segments == ()


def test_curves_are_followed_within_a_centimetre(tmp_path: Path) -> None:
    body = (
        '<circle cx="40" cy="40" r="30"/><ellipse cx="40" cy="40" rx="20" ry="8"/><path d="M90 90C90 80 80 70 85 70"/>'
    )
    (area,) = svg(tmp_path, body.replace("/>", ' stroke="red" fill="none"/>')).template.areas
    radii = np.hypot(*(np.array(area.outline) - (40.0, -40.0)).T)
    assert radii == pytest.approx(30.0)
    chords = shapely.LinearRing(area.outline).distance(shapely.Point(40.0, -40.0))
    assert 30.0 - 0.01 <= chords < 30.0
    (hole,) = area.holes
    t = np.linspace(0, math.tau, 2000)
    drawn = np.column_stack((40 + 20 * np.cos(t), -40 + 8 * np.sin(t)))
    assert shapely.hausdorff_distance(shapely.LinearRing(hole), shapely.LinearRing(drawn), 0.1) <= 0.01
    assert len(area.outline) < 200 and len(hole) < 200


def test_what_is_open_stays_a_line(tmp_path: Path) -> None:
    imported = svg(tmp_path, f'<path d="{BOX}"/><line x1="30" y1="0" x2="40" y2="0" stroke="black"/>')
    assert len(imported.template.areas) == len(imported.template.segments) == 1


STAR = [(10 + 10 * math.sin(0.8 * math.pi * k), 10 + 10 * math.cos(0.8 * math.pi * k)) for k in range(5)]
BOW = [(0, 0), (10, 8), (10, 0), (0, 8)]


def test_shapes_that_cross_themselves_are_mended_where_their_inside_is_clear(tmp_path: Path) -> None:
    imported = dxf(tmp_path, lambda space: space.add_lwpolyline(BOW, close=True))
    assert shape(imported.template) == [(20.0, 0), (20.0, 0)]
    assert len(imported.found.mended) == 1
    with pytest.raises(SpecError, match=r"lwpolyline-\w+ crosses itself and goes round .* save it as SVG"):
        dxf(tmp_path, lambda space: space.add_lwpolyline(STAR, close=True))
    points = " ".join(f"{x},{y}" for x, y in STAR)
    whole, rays = (
        svg(tmp_path, f'<polygon points="{points}" fill-rule="{rule}"/>').template for rule in ("nonzero", "evenodd")
    )
    assert len(whole.areas) == 1
    assert len(rays.areas) == 5  # five rays that touched in points
    assert whole.area_m2 > rays.area_m2 > 0.6 * whole.area_m2


def drawn_in_many_ways(space: Any) -> None:
    space.add_circle((0, 0), 5)
    space.add_ellipse((20, 0), (6, 0), 0.5)
    space.add_lwpolyline([(30, 0), (40, 0), (40, 5), (30, 5), (30, 0)])  # ends where it begins, but is not closed
    space.add_lwpolyline([(50, 0, 1), (60, 0, 1)], format="xyb", close=True)  # two half circles
    space.add_spline().set_closed([(70, 0, 0), (80, 0, 0), (80, 10, 0), (70, 10, 0)])
    space.add_polyline2d([(0, 20), (10, 20), (10, 30)], close=True)


def test_dxf_shapes_of_every_kind(tmp_path: Path) -> None:
    template = dxf(tmp_path, drawn_in_many_ways).template
    assert template.segments == ()
    found = sorted((area.id.split("-")[0], area.polygon.area) for area in template.areas)
    assert [kind for kind, _ in found] == ["circle", "ellipse", "lwpolyline", "lwpolyline", "polyline", "spline"]
    expected = [math.pi * 25, math.pi * 18, 50.0, math.pi * 25, 50.0]
    assert [area for _, area in found[:5]] == pytest.approx(expected, rel=0.012)
    assert 30.0 < found[5][1] < 100.0


def hatched(space: Any) -> None:
    hatch = space.add_hatch()
    outer, inner = [(0, 0), (30, 0), (30, 20), (0, 20)], [(5, 5), (15, 5), (15, 15), (5, 15)]
    hatch.paths.add_polyline_path(outer, is_closed=True, flags=1)
    hatch.paths.add_polyline_path(inner, is_closed=True, flags=16)
    space.add_lwpolyline(outer, close=True)
    space.add_lwpolyline(inner, close=True)


def test_a_hatch_and_the_lines_round_it_are_one_area(tmp_path: Path) -> None:
    assert shape(dxf(tmp_path, hatched).template) == [(500.0, 1)]


def layered(space: Any) -> None:
    for layer, low, high in (("Fence", -5, 45), ("Field", 0, 40), ("Field", 10, 12), ("Trees", 20, 22)):
        corners = [(low, low), (high, low), (high, high), (low, high)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})


def test_layers_are_chosen_and_one_may_be_the_boundary(tmp_path: Path) -> None:
    assert shape(dxf(tmp_path, layered, layers=("field",)).template) == [(1596.0, 1)]
    fenced = dxf(tmp_path, layered, boundary="Fence").template
    assert shape(fenced) == [(1592.0, 2)]
    assert fenced.boundary is not None
    assert shapely.Polygon(fenced.boundary.corners).bounds == (-5, -5, 45, 45)
    both = dxf(tmp_path, layered, boundary="Field", layers=("Field",)).template
    assert shape(both) == [(1596.0, 1)] and both.boundary is not None
    body = (
        '<g inkscape:label="Pan" id="g1"><g id="g2"><rect width="9" height="9"/></g></g><rect width="80" height="80"/>'
    )
    for layer in ("Pan", "g1", "g2"):
        assert shape(svg(tmp_path, body, layers=(layer,)).template) == [(81.0, 0)]


def test_a_boundary_moves_with_the_drawing(tmp_path: Path) -> None:
    drawing = ezdxf.new(units=6)
    layered(drawing.modelspace())
    drawing.saveas(tmp_path / "field.dxf")
    template = import_drawing(tmp_path / "field.dxf", ImportOptions(areas=True, boundary="Fence")).template
    assert template.boundary is not None
    assert shapely.Polygon(template.boundary.corners).bounds == (-25, -25, 25, 25)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"layers": ("Meadow",)}, r"--layer is 'Meadow', in which nothing is drawn; give one of: Fence, Field, Trees"),
        ({"boundary": "Hedge"}, r"--boundary is 'Hedge', in which nothing is drawn"),
        ({"fill": True}, r"--fill is given with --areas"),
    ],
)
def test_what_cannot_be_chosen_is_refused(tmp_path: Path, options: dict[str, Any], says: str) -> None:
    with pytest.raises(SpecError, match=says):
        dxf(tmp_path, layered, **options)


def test_more_refusals(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"has no closed shape for the boundary"):
        dxf(tmp_path, lambda space: space.add_line((0, 0), (9, 0)), boundary="0", layers=("0",))
    with pytest.raises(SpecError, match=r"give --layer '0' as well"):
        dxf(tmp_path, lambda space: space.add_circle((0, 0), 9), boundary="0")
    squares = "".join(f'<rect x="{2 * (k % 12)}" y="{2 * (k // 12)}" width="1" height="1"/>' for k in range(120))
    with pytest.raises(SpecError, match=r"makes 120 areas, more than the 100 .* --layer"):
        svg(tmp_path, squares)
    with pytest.raises(SpecError, match=r"has 120 holes, more than the 100"):
        svg(tmp_path, f'<rect x="-1" y="-1" width="50" height="50"/>{squares}')
    crumbs = svg(
        tmp_path, f'<path d="{BOX}"/><rect x="40" width="0.1" height="0.1"/><path d="M50 0H60Z" stroke="red"/>'
    )
    assert shape(crumbs.template) == [(200.0, 0)]
    assert crumbs.found.small == 2


def test_rings_enclose_what_the_rule_says() -> None:
    """Random polygons that cross themselves, against winding numbers of random points."""
    rng = np.random.default_rng(3)
    for rule, corners in itertools.product(FillRule, (3, 5, 9)):
        rings = [rng.uniform(0, 10, (corners, 2)) for _ in range(3)]
        inside = shapely.union_all(enclosed(rings, rule))
        assert inside.is_valid
        for x, y in rng.uniform(0, 10, (60, 2)):
            angles = [np.unwrap(np.arctan2(*(np.vstack((ring, ring[:1])) - (x, y)).T[::-1])) for ring in rings]
            times = sum(round((angle[-1] - angle[0]) / math.tau) for angle in angles)
            assert inside.contains(shapely.Point(x, y)) == (times % 2 == 1 if rule is FillRule.EVEN_ODD else times != 0)
